// Begins: the views say what they watch, and then the page connects.

import "./overview.js";
import "./player.js";
import "./control.js";
import "./actuators.js";
import "./goals.js";
import "./forms.js";
import "./plan.js";
import "./map.js";
import "./beliefs.js";
import "./chart.js";
import "./journal.js";
import { begin } from "./connection.js";

begin();
