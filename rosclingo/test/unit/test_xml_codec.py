"""The wire format: fixtures for what is right and what is wrong, and properties for the rest."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Tuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rosclingo.errors import XmlError
from rosclingo.wire import xml_codec
from rosclingo.wire.commands import (
    Add,
    AssignExternal,
    Assumption,
    CleanupDomains,
    Command,
    ConflictLimit,
    CostBound,
    Externals,
    Failure,
    GetExternals,
    GetPrograms,
    GetStats,
    Ground,
    Load,
    Part,
    Programs,
    ReleaseExternal,
    Reply,
    Restart,
    Restarts,
    Stats,
    Truth,
    command_name,
)
from rosclingo.wire.xml_codec import (
    decode_assumptions,
    decode_commands,
    decode_reply,
    encode_assumptions,
    encode_commands,
    encode_reply,
)
from rosclingo.wire.xml_tree import MAX_ELEMENTS, parse

FIXTURES = Path(__file__).parents[1] / "xml"


def _decoder(fixture: str) -> Callable[[bytes], Any]:
    if "valid-assumptions" in fixture:
        return decode_assumptions
    return decode_reply if "valid-return" in fixture else decode_commands


# --- what is wrong: one fixture for each way -------------------------------------------------


class Expected(NamedTuple):
    line: int
    column: int
    command: str
    position: int
    message: str


def _expectations() -> Dict[str, Expected]:
    table = {}
    for line in (FIXTURES / "invalid.txt").read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            name, row, column, command, index, message = line.split(" ", 5)
            table[name] = Expected(int(row), int(column), command, int(index), message)
    return table


EXPECTED = _expectations()
INVALID = sorted(path.stem for path in FIXTURES.glob("invalid-*.xml"))


def test_every_invalid_fixture_has_an_expectation() -> None:
    assert sorted(EXPECTED) == INVALID


@pytest.mark.parametrize("name", INVALID)
def test_invalid_fixture(name: str) -> None:
    expected = EXPECTED[name]
    with pytest.raises(XmlError) as caught:
        _decoder(name)((FIXTURES / f"{name}.xml").read_bytes())
    err = caught.value
    assert (err.line, err.column) == (expected.line, expected.column)
    assert (err.command or "-", err.index) == (expected.command, expected.position)
    assert expected.message in str(err)
    if err.line:
        assert str(err).startswith(f"line {err.line}, column {err.column}: ")


# --- what is right ---------------------------------------------------------------------------

VALID: Dict[str, Any] = {
    # Every command of the manual, in its order; its placeholders stand for themselves.
    "valid-manual": (
        Add("NAME_OF_THE_PROGRAM_TO_BE_ADDED", ("NAME_OF_THE_PARAMETER",), " PROGRAM "),
        AssignExternal("EXTERNAL_TO_BE_ASSIGNED", Truth.TRUE),
        CleanupDomains(),
        Ground((Part("NAME_OF_THE_PROGRAM_TO BE_GROUNEDED", ("VALUE_OF_THE_PARAMETER",)),)),
        Load("PATH_TO_THE_FILE"),
        ReleaseExternal("EXTERNAL_TO_BE_RELEASED"),
        GetExternals(),
        GetStats(),
        Restart(),
    ),
    "valid-empty": (),
    "valid-add": (Add("base", (), "a."),),
    "valid-add-empty-program": (Add("p", (), ""),),
    "valid-add-parameters": (Add("p", ("s", "t"), "a(s,t)."),),
    "valid-add-cdata": (Add("p", (), 'a :- 1 < 2, "&amp;" != "x". % ]]>\n'),),
    "valid-add-escaped": (Add("p", (), 'a :- 1 < 2.\r\n\tb(""&").'),),
    "valid-add-comment": (Add("p", (), "a.b."),),
    "valid-assign-external": (
        AssignExternal("query(1)", Truth.TRUE),
        AssignExternal("q", Truth.FALSE),
        AssignExternal("q", Truth.FREE),
        AssignExternal("q", Truth.FREE),
    ),
    "valid-cleanup-domains": (CleanupDomains(),),
    "valid-declaration": (Restart(),),
    "valid-get-externals": (GetExternals(),),
    "valid-get-stats": (GetStats(),),
    "valid-ground": (Ground((Part("base"), Part("p", ('f(1,"x y")', "2+3")))),),
    "valid-latin1": (Load("ä.lp"),),
    "valid-load": (Load("a&b/äöü 1.lp"),),
    "valid-release-external": (ReleaseExternal("query(1)"),),
    "valid-restart": (Restart(),),
    "valid-utf16": (Load("ä.lp"),),
    "valid-assumptions": (
        Assumption("query(1)", True),
        Assumption("do(arm,pickup(4),1)", False),
    ),
    "valid-assumptions-empty": (),
    "valid-assumptions-none": (),
    "valid-return": Reply(),
    "valid-return-answers": Reply(
        (
            Externals((("query(1)", Truth.FREE),)),
            Stats({"summary": {"call": 1.0}}),
            Externals(()),
        )
    ),
    "valid-return-failure": Reply((Externals(()),), Failure("load", 1, "there is no file 'x'")),
}


def test_every_valid_fixture_has_an_expectation() -> None:
    assert sorted(path.stem for path in FIXTURES.glob("valid-*.xml")) == sorted(VALID)


@pytest.mark.parametrize("name", sorted(VALID))
def test_valid_fixture(name: str) -> None:
    assert _decoder(name)((FIXTURES / f"{name}.xml").read_bytes()) == VALID[name]


@pytest.mark.parametrize("name", ["valid-latin1", "valid-utf16", "valid-declaration"])
def test_a_text_is_read_whatever_encoding_it_declares(name: str) -> None:
    # A ROS message holds text, not bytes; what it declares is no longer true then.
    encoding = {"valid-latin1": "latin-1", "valid-utf16": "utf-16"}.get(name, "utf-8-sig")
    text = (FIXTURES / f"{name}.xml").read_bytes().decode(encoding)
    assert decode_commands(text) == VALID[name]


def test_the_words_of_the_protocol() -> None:
    assert encode_reply(Reply()) == "<return>\n<success>\nTrue\n</success>\n</return>"
    failed = Reply((Externals((("q(1)", Truth.TRUE),)),), Failure("load", 2, 'a < "b"'))
    assert encode_reply(failed).splitlines() == [
        *("<return>", "<success>", "False", "</success>"),
        *('<error command="load" index="2">', 'a &lt; "b"', "</error>"),
        *("<externals>", '<external name="q(1)" value="true"/>', "</externals>", "</return>"),
    ]
    assert encode_assumptions([Assumption("a", False)]) == (
        '<assumptions><assumption name="a" value="false"/></assumptions>'
    )
    manual = VALID["valid-manual"]
    assert [command_name(command) for command in manual] == [
        *("add", "assign_external", "cleanup_domains", "ground", "load", "release_external"),
        *("get_externals", "get_stats", "restart"),
    ]


@pytest.mark.parametrize("name", ["valid-return-failure", "valid-return-answers"])
def test_replies_in_one_line_are_read_too(name: str) -> None:
    """Older nodes send them, and so do the bags of their control logs."""
    text = (FIXTURES / f"{name}.xml").read_text().strip()
    assert "\n" not in text
    reply = decode_reply(text)
    assert reply == VALID[name]
    assert decode_reply(encode_reply(reply)) == reply


def test_statistics_that_nest_too_deeply_are_refused() -> None:
    text = f"<return><success>True</success><stats>{'[' * 200_000}</stats></return>"
    with pytest.raises(XmlError, match="does not hold JSON"):
        decode_reply(text)


def test_elements_are_counted_while_they_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    most = 1000
    monkeypatch.setattr(xml_codec, "MAX_ELEMENTS", most)
    text = "<commands>" + "<a/>" * 2 * most + "</commands>"
    with pytest.raises(XmlError, match="too many elements") as caught:
        decode_commands(text)
    assert caught.value.column == len("<commands>") + 4 * (most - 1) + 1
    with pytest.raises(XmlError, match="too many elements"):
        decode_assumptions("<assumptions>" + '<assumption name="a" value="true"/>' * most)
    assumptions = (Assumption("a", True),) * (most - 1)
    assert decode_assumptions(encode_assumptions(assumptions)) == assumptions


@pytest.mark.costly
def test_a_reply_may_be_large() -> None:
    reply = Reply((Externals((("a", Truth.TRUE),) * MAX_ELEMENTS),))
    assert decode_reply(encode_reply(reply)) == reply


def test_an_element_is_small() -> None:
    assert not hasattr(parse("<a/>"), "__dict__")


@pytest.mark.parametrize(
    "text", ["<commands><{}/></commands>", "<{}/>", "<commands {}=''/>", "<commands>{}</commands>"]
)
def test_no_message_quotes_all_of_a_long_text(text: str) -> None:
    with pytest.raises(XmlError) as caught:
        decode_commands(text.format("a" * 1_000_000))
    assert len(str(caught.value)) < 1000
    assert len(str(caught.value.command)) < 1000


def test_depth_does_not_end_the_process() -> None:
    for tag in ("<a>", "<commands>", "<add name='p'>"):
        with pytest.raises(XmlError, match="deeper than 16"):
            decode_commands(tag * 200_000)


# --- properties ------------------------------------------------------------------------------

# What XML is most likely to change on its way: line ends, quotes, markup, blanks at the ends.
TEXT = st.text(
    st.sampled_from("\t\n\r \"'<>&;]![a")
    | st.characters(
        min_codepoint=0x20, exclude_categories=["Cs"], exclude_characters="\ufffe\uffff"
    )
)
TEXTS = st.lists(TEXT, max_size=3).map(tuple)
TRUTH = st.sampled_from(Truth)
PARTS = st.lists(st.builds(Part, TEXT, TEXTS), min_size=1, max_size=3).map(tuple)
NAMES = st.lists(st.from_regex("[a-z_]+", fullmatch=True), max_size=3).map(tuple)
COMMANDS: st.SearchStrategy[List[Command]] = st.lists(
    st.one_of(
        st.builds(Add, TEXT, TEXTS, TEXT),
        st.builds(Ground, PARTS, st.booleans(), NAMES),
        st.builds(Load, TEXT),
        st.builds(AssignExternal, TEXT, TRUTH),
        st.builds(ReleaseExternal, TEXT),
        st.sampled_from([CleanupDomains(), GetExternals(), GetPrograms(), GetStats(), Restart()]),
    ),
    max_size=5,
)
ASSUMPTIONS = st.lists(st.builds(Assumption, TEXT, st.booleans()), max_size=5)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)
ANSWERS = st.lists(
    st.builds(Externals, st.lists(st.tuples(TEXT, TRUTH), max_size=3).map(tuple))
    | st.builds(Programs, st.lists(st.tuples(TEXT, st.integers(0, 9)), max_size=3).map(tuple))
    | st.builds(Stats, st.dictionaries(st.text(), JSON, max_size=3)),
    max_size=3,
).map(tuple)
REPLIES = st.builds(
    Reply, ANSWERS, st.none() | st.builds(Failure, TEXT, st.integers(-1, 10**9), TEXT)
)


@pytest.mark.costly
@given(COMMANDS)
def test_commands_come_back_as_they_were(commands: List[Command]) -> None:
    text = encode_commands(commands)
    assert decode_commands(text) == tuple(commands)
    assert decode_commands(text.encode()) == tuple(commands)


@given(ASSUMPTIONS)
def test_assumptions_come_back_as_they_were(assumptions: List[Assumption]) -> None:
    text = encode_assumptions(assumptions)
    assert decode_assumptions(text) == tuple(assumptions)
    assert decode_assumptions(text.encode()) == tuple(assumptions)


@pytest.mark.costly
@given(REPLIES)
def test_replies_come_back_as_they_were(reply: Reply) -> None:
    text = encode_reply(reply)
    assert decode_reply(text) == reply
    assert decode_reply(text.encode()) == reply


PIECES = st.sampled_from(
    [
        *("<commands>", "</commands>", "<commands/>", "<ground>", "</ground>", "<add", "name='p'"),
        *("name=p", ">", "/>", "<program>", "</program>", "<assumptions>", "</assumptions>", " "),
        *("<return>", "</return>", "<success>", "True", "</success>", "<stats>", "</stats>", "{}"),
        *("[", "<![CDATA[", "]]>", "<!--", "-->", "<?xml", "?>", "<!DOCTYPE", "&amp;", "&#0;"),
        *("&#x110000;", "&x;", "\0", "\ud800", "\ufffe", "é"),
    ]
)
SOUP = st.lists(PIECES | st.text(max_size=3), max_size=12).map("".join)


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """Something right, with a few bytes of it replaced, so that it gets past the beginning."""
    right: st.SearchStrategy[str] = st.one_of(
        COMMANDS.map(encode_commands),
        ASSUMPTIONS.map(encode_assumptions),
        REPLIES.map(encode_reply),
    )
    data = bytearray(draw(right).encode())
    for _ in range(draw(st.integers(1, 3))):
        begin = draw(st.integers(0, len(data)))
        data[begin : begin + draw(st.integers(0, 4))] = draw(st.binary(max_size=4))
    return bytes(data)


@pytest.mark.costly
@settings(max_examples=300)
@given(st.binary() | st.text() | SOUP | damaged())
def test_nothing_raises_anything_but_the_error_of_the_codec(text: Any) -> None:
    texts = [text]
    if isinstance(text, bytes):
        texts.append(text.decode("utf-8", "surrogateescape"))
    for decode in (decode_commands, decode_assumptions, decode_reply):
        for one in texts:
            with contextlib.suppress(XmlError):
                assert decode(one) is not None


ILLEGAL = st.sampled_from("\0\x01\x08\x0b\x0c\x1f\ud800\udfff\ufffe\uffff")


@given(TEXT, ILLEGAL, TEXT)
def test_what_xml_cannot_carry_is_refused(before: str, illegal: str, after: str) -> None:
    text = before + illegal + after
    commands: Tuple[Command, ...] = (
        Add(text, (), "a."),
        Add("p", (text,), "a."),
        Add("p", (), text),
        Ground((Part(text),)),
        Ground((Part("p", (text,)),)),
        Load(text),
        AssignExternal(text, Truth.TRUE),
        ReleaseExternal(text),
    )
    for command in commands:
        with pytest.raises(XmlError, match="cannot carry"):
            encode_commands([command])
    with pytest.raises(XmlError, match="cannot carry"):
        encode_assumptions([Assumption(text, True)])


@given(TEXT, ILLEGAL, TEXT)
def test_a_reply_is_always_encoded(before: str, illegal: str, after: str) -> None:
    # The node must answer, also when a message quotes what the client sent.
    text = before + illegal + after
    failure = decode_reply(encode_reply(Reply(failure=Failure(text, 0, text)))).failure
    replaced = before + "\ufffd" + after
    assert failure == Failure(replaced, 0, replaced)


def test_a_reply_with_any_external_is_encoded() -> None:
    # A string of a loaded file may hold any character.
    reply = Reply((Externals((('e("\x01")', Truth.TRUE),)),))
    assert decode_reply(encode_reply(reply)).success


def test_bounds_of_costs() -> None:
    assumed = [Assumption("a", True), CostBound((3, -17)), ConflictLimit(100), Restarts("L,60")]
    text = encode_assumptions(assumed)
    assert (
        '<cost_bound value="3 -17"/><conflict_limit value="100"/><restarts value="L,60"/>' in text
    )
    assert decode_assumptions(text) == tuple(assumed)


@pytest.mark.parametrize("count", ["", "x", "-1", "1.5", "²", "9" * 5000])
def test_a_wrong_number_of_parameters(count: str) -> None:
    """Python refuses to read more than 4,300 digits."""
    program = f'<program name="a" parameters="{count}"/>'
    text = f"<return><success/><programs>{program}</programs></return>"
    with pytest.raises(XmlError, match="a number of at most nine digits") as caught:
        decode_reply(text)
    assert len(str(caught.value)) < 300


@pytest.mark.parametrize(
    ("limit", "wrong"), [("cost_bound", "3,17"), ("conflict_limit", "-1"), ("restarts", "L;60")]
)
def test_a_wrong_limit(limit: str, wrong: str) -> None:
    for value in ("", "x", "1.5", wrong, "9" * 30):
        with pytest.raises(XmlError, match=limit.replace("_", " ").rstrip("s")):
            decode_assumptions(f'<assumptions><{limit} value="{value}"/></assumptions>')
