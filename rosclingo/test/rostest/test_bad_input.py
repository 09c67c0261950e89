"""What a client may get wrong or mean ill: the node says what is wrong, lives, and is correct."""

from __future__ import annotations

import os
import queue
import sys
import tempfile

import rospy
import rostest
from rosgraph_msgs.msg import Log
from waiting import wait_for

from solver_test_case import SolverTestCase

ENTITIES = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 10))


class TestBadInput(SolverTestCase):
    def setUp(self) -> None:
        self.succeed(
            '<restart/><add name="step"><parameter_definition name="t"/><program>'
            "#external query(t).</program></add>"
            '<ground><program name="step"><parameter value="1"/></program></ground>'
        )

    def tearDown(self) -> None:
        self.assert_solves()

    def refused(self, text: str, *pieces: str) -> None:
        """The whole request is refused, with these pieces in the reason."""
        reply = self.control_service(text).result
        self.assertTrue(reply.startswith("<return>\n<success>\nFalse\n</success>\n<error "), reply)
        for piece in pieces:
            self.assertIn(piece, reply)

    def command_refused(self, command: str, *pieces: str) -> None:
        self.refused(f"<commands>\n{command}</commands>", *pieces)

    def test_ill_formed(self) -> None:
        self.refused("<commands><restart></commands>", "line 1, column 22", "mismatched tag")

    def test_unquoted_attribute(self) -> None:
        self.command_refused("<load file=x.lp/>", "line 2, column 12", "quotes")

    def test_unknown_element(self) -> None:
        self.command_refused("<explode/>", "line 2, column 1", "explode", "get_externals")

    def test_unknown_attribute(self) -> None:
        self.command_refused('<restart now="1"/>', "line 2, column 1", "no attribute now")

    def test_missing_attribute(self) -> None:
        self.command_refused('<assign_external name="query(1)"/>', "line 2", "attribute value")

    def test_making_false_what_there_is_not_is_no_warning(self) -> None:
        warnings: queue.Queue[str] = queue.Queue()
        log = rospy.Subscriber("/rosout", Log, lambda line: warnings.put(line.msg))
        wait_for(log.get_num_connections)
        for value, step in (("false", 6), ("true", 7)):
            self.command_refused(
                f'<assign_external name="query({step})" value="{value}"/>', f"query({step})"
            )
        warning = ""
        while "query(7)" not in warning:
            warning = warnings.get(timeout=60)
            self.assertNotIn("query(6)", warning)

    def test_entity_expansion(self) -> None:
        self.refused(
            f'<!DOCTYPE c [<!ENTITY l0 "lol">{ENTITIES}]><commands>&l9;</commands>', "DOCTYPE"
        )

    def test_external_entity(self) -> None:
        self.refused(
            '<!DOCTYPE c [<!ENTITY e SYSTEM "file:///etc/hostname">]><commands>&e;</commands>',
            "not allowed",
        )

    def test_too_large(self) -> None:
        self.refused(
            f"<commands><!--{' ' * (20 * 2**20)}--><restart/></commands>", "~max_request_bytes"
        )

    def test_control_characters(self) -> None:
        for character in "\0\1\x0b\x1f":
            with self.subTest(character=character):
                self.refused(f"<commands>{character}</commands>", "line 1, column 11")

    def test_unparsable_atom(self) -> None:
        for command in ("assign_external", "release_external"):
            value = ' value="true"' if command == "assign_external" else ""
            for atom in ("query(", "a b", "1..2", "é", ""):
                with self.subTest(command=command, atom=atom):
                    self.command_refused(f'<{command} name="{atom}"{value}/>', "not a ground term")

    def test_too_deep_an_atom(self) -> None:
        atom = "f(" * 100_000 + "1" + ")" * 100_000
        self.command_refused(f'<release_external name="{atom}"/>', "nests deeper")

    def test_non_ground_parameter(self) -> None:
        self.command_refused(
            '<ground><program name="step"><parameter value="f(X)"/></program></ground>',
            "X begins a variable",
        )

    def test_unknown_program(self) -> None:
        self.command_refused(
            '<ground><program name="nowhere"/></ground>', "nowhere/0", "base/0, step/1"
        )

    def test_unknown_external(self) -> None:
        self.command_refused(
            '<assign_external name="query(5)" value="true"/>', "no external query(5)"
        )

    def test_syntax_error(self) -> None:
        self.command_refused(
            '<add name="p"><program>a.\nb c.</program></add>', ":2:3-4: error: syntax error"
        )

    def test_unsafe_variable(self) -> None:
        self.command_refused('<add name="p"><program>a(X).</program></add>', "unsafe", ":1:3-4")

    def test_not_ascii(self) -> None:
        self.command_refused('<add name="p"><program>é.</program></add>', "lexer error")

    def test_too_deep_a_program(self) -> None:
        program = "a(" + "-" * 100_000 + "1)."
        self.command_refused(f'<add name="p"><program>{program}</program></add>', "nests deeper")

    def test_script(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            mark = os.path.join(folder, "mark")
            self.command_refused(
                f'<add name="p"><program>#script (python) open("{mark}","w") #end.</program></add>',
                "#script",
                "~allow_scripts",
            )
            self.assertFalse(os.path.exists(mark))

    def test_load_outside(self) -> None:
        example = rospy.get_param("~example")
        self.command_refused('<load file="/etc/hostname"/>', "outside")
        outside = os.path.join(example, "..", "package.xml")
        self.command_refused(f'<load file="{outside}"/>', "outside", "~load_path")
        self.command_refused('<load file="/dev/zero"/>', "outside")

    def test_load_by_symlink(self) -> None:
        # The node may load from this folder; the link in it leads out.
        with tempfile.TemporaryDirectory(dir=rospy.get_param("~loadable")) as folder:
            link = os.path.join(folder, "link.lp")
            os.symlink("/etc/hostname", link)
            self.command_refused(f'<load file="{link}"/>', "outside")

    def test_include_outside(self) -> None:
        add = '<add name="p"><program>#include "{}".</program></add>'
        self.command_refused(add.format("/etc/hostname"), "outside")
        with tempfile.TemporaryDirectory(dir=rospy.get_param("~loadable")) as folder:
            link = os.path.join(folder, "link.lp")
            os.symlink("/etc/hostname", link)
            self.command_refused(add.format(link), "outside")
            file = os.path.join(folder, "file.lp")
            for included in (link, "link.lp", "../../../../../../../../etc/hostname"):
                with open(file, "w", encoding="utf-8") as stream:
                    stream.write(f'#include "{included}".\n')
                self.command_refused(f'<load file="{file}"/>', "outside")

    def test_load_of_nothing(self) -> None:
        loadable = rospy.get_param("~loadable")
        self.command_refused(f'<load file="{loadable}/nothing.lp"/>', "there is no file")
        self.command_refused(f'<load file="{loadable}"/>', "there is no file")

    def test_assumptions(self) -> None:
        for text in (
            "<assumptions",
            "<commands/>",
            '<assumptions><assumption name="a"/></assumptions>',
            '<assumptions><assumption name="a" value="free"/></assumptions>',
            '<assumptions><assumption name="f(X)" value="true"/></assumptions>',
            '<assumptions><assumption name="a." value="true"/></assumptions>',
            " " * (17 * 2**20),
        ):
            with self.subTest(text=text[:80]):
                status, result, reason = self.goal(text).result()
                self.assertEqual((status, result.result), ("REJECTED", "unknown"))
                self.assertTrue(reason)

    def test_a_rejected_goal_leaves_the_running_one_alone(self) -> None:
        goal = self.search_for_minutes()
        self.assertEqual(self.goal("<assumptions").result()[0], "REJECTED")
        goal.cancel()
        self.assertEqual(goal.result()[0], "PREEMPTED")


if __name__ == "__main__":
    rospy.init_node("test_bad_input")
    rostest.rosrun("rosclingo", "test_bad_input", TestBadInput, sys.argv)
