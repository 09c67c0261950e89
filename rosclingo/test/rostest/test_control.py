"""Every control command of the manual, through the service."""

from __future__ import annotations

import os
import sys

import rospy
import rostest

from rosclingo.wire.commands import Externals, Stats, Truth
from solver_test_case import SolverTestCase

STEP = "#external query(t). { a(t) }. :- query(t), not a(t). #show a/1."


class TestControl(SolverTestCase):
    def setUp(self) -> None:
        self.succeed("<restart/>")

    def externals(self) -> dict:
        (answer,) = self.succeed("<get_externals/>").answers
        assert isinstance(answer, Externals)
        return dict(answer.values)

    def add_step(self) -> None:
        self.succeed(
            f'<add name="step"><parameter_definition name="t"/><program>{STEP}</program></add>'
            '<ground><program name="step"><parameter value="1"/></program>'
            '<program name="step"><parameter value="2"/></program></ground>'
        )

    def test_the_reply_has_the_form_of_the_manual(self) -> None:
        text = self.control_service("<commands/>").result
        self.assertEqual(text, "<return>\n<success>\nTrue\n</success>\n</return>")

    def test_add_and_ground(self) -> None:
        self.add_step()
        _, result, _ = self.goal().result()
        self.assertEqual(result.result, "sat")

    def test_several_parameters_and_terms(self) -> None:
        self.succeed(
            '<add name="edge"><parameter_definition name="x"/><parameter_definition name="y"/>'
            '<program>edge(x,y).</program></add><ground><program name="edge">'
            '<parameter value="f(1,&quot;a b&quot;)"/><parameter value="2+3"/></program></ground>'
        )
        _, result, _ = self.goal().result()
        self.assertEqual(result.answerset, ['edge(f(1,"a b"),5)'])

    def test_externals(self) -> None:
        self.add_step()
        self.assertEqual(self.externals(), {"query(1)": Truth.FALSE, "query(2)": Truth.FALSE})
        self.succeed('<assign_external name="query(2)" value="True"/>')
        self.assertEqual(self.externals()["query(2)"], Truth.TRUE)
        _, result, _ = self.goal().result()
        self.assertIn("a(2)", result.answerset)
        self.succeed(
            '<assign_external name="query(2)" value="None"/>'
            '<assign_external name="query(1)" value="FREE"/>'
        )
        self.assertEqual(self.externals(), {"query(1)": Truth.FREE, "query(2)": Truth.FREE})
        self.succeed('<release_external name="query(2)"/>')
        self.assertEqual(self.externals(), {"query(1)": Truth.FREE})

    def test_cleanup_domains(self) -> None:
        self.add_step()
        self.succeed("<cleanup_domains/>")
        _, result, _ = self.goal().result()
        self.assertEqual(result.result, "sat")

    def test_load(self) -> None:
        itoh = os.path.join(rospy.get_param("~example"), "itoh.lp")
        self.succeed(
            f'<load file="{itoh}"/><ground><program name="query"><parameter value="7"/></program>'
            "</ground>"
        )
        self.assertEqual(self.externals(), {"query(7)": Truth.FALSE})

    def test_stats(self) -> None:
        self.add_step()
        self.goal().result()
        (answer,) = self.succeed("<get_stats/>").answers
        assert isinstance(answer, Stats)
        self.assertEqual(answer.values["summary"]["call"], 0)
        self.assertGreater(answer.values["problem"]["lp"]["rules"], 0)

    def test_answers_come_in_order(self) -> None:
        answers = self.succeed("<get_stats/><get_externals/><get_stats/>").answers
        self.assertEqual([type(answer) for answer in answers], [Stats, Externals, Stats])

    def test_the_first_failure_ends_the_list_and_what_ran_stays(self) -> None:
        self.add_step()
        reply = self.control(
            '<assign_external name="query(1)" value="true"/><get_externals/>'
            '<assign_external name="query(9)" value="true"/>'
            '<assign_external name="query(2)" value="true"/>'
        )
        assert reply.failure is not None
        self.assertEqual((reply.failure.command, reply.failure.index), ("assign_external", 2))
        self.assertIn("query(9)", reply.failure.message)
        self.assertEqual(len(reply.answers), 1)
        self.assertEqual(self.externals(), {"query(1)": Truth.TRUE, "query(2)": Truth.FALSE})

    def test_restart_after_everything(self) -> None:
        self.add_step()
        self.succeed('<assign_external name="query(1)" value="true"/><cleanup_domains/>')
        self.goal().result()
        self.succeed("<restart/>")
        self.assertEqual(self.externals(), {})
        self.add_step()
        self.assertEqual(self.externals()["query(1)"], Truth.FALSE)
        self.assert_solves()


if __name__ == "__main__":
    rospy.init_node("test_control")
    rostest.rosrun("rosclingo", "test_control", TestControl, sys.argv)
