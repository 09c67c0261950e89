"""Programs and files: what is parsed, what is refused, and what a client may reach."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Callable, List, Tuple

import pytest
from waiting import Within

from rosclingo.errors import (
    ForbiddenError,
    OptionsError,
    ProgramError,
    RosclingoError,
    SolverError,
)
from rosclingo.solver import programs
from rosclingo.solver.controls import ClingoMessages
from rosclingo.solver.engine import Engine
from rosclingo.solver.options import Options
from rosclingo.solver.programs import Policy
from rosclingo.wire.commands import Add, Ground, Load, Part, Restart, Result


@pytest.fixture
def allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that clients may load from; the working directory is another one."""
    for name in ("allowed/sub", "allowed-not", "work"):
        (tmp_path / name).mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "work")
    write(tmp_path / "secret.lp", "secret.")
    write(tmp_path / "allowed-not" / "secret.lp", "secret.")
    folder = tmp_path / "allowed"
    write(folder / "start.lp", "start.")
    write(folder / "sub" / "inside.lp", "inside.")
    (folder / "link.lp").symlink_to(tmp_path / "secret.lp")
    (folder / "way").symlink_to(tmp_path, target_is_directory=True)
    return folder


def write(path: Path, text: str) -> str:
    path.write_text(text, encoding="utf-8")
    return str(path)


def policy_of(folder: Path) -> Policy:
    return Policy(load_path=(str(folder),))


@pytest.fixture
def engine(allowed: Path) -> Engine:
    """A solver that loads files from that folder."""
    return Engine(Options(), policy_of(allowed))


@pytest.fixture
def scripting() -> Engine:
    """A solver that runs scripts of clients."""
    return Engine(Options(), Policy(allow_scripts=True))


def facts(engine: Engine, *parts: str) -> Tuple[str, ...]:
    """Grounds parts, solves, and returns what is shown."""
    engine.apply(Ground(tuple(Part(part) for part in parts or ("base",))))
    outcome = engine.solve()
    assert outcome.result is Result.SAT
    return tuple(sorted(outcome.symbols))


# --- where files may come from ---------------------------------------------------------------

OUTSIDE = [
    "../secret.lp",
    "link.lp",
    "way/secret.lp",
    "sub/../../secret.lp",
    "../allowed-not/secret.lp",
]


@pytest.mark.parametrize("path", OUTSIDE)
def test_load_from_outside_is_refused(path: str, allowed: Path, engine: Engine) -> None:
    for name in (str(allowed / path), f"../allowed/{path}"):
        with pytest.raises(ForbiddenError, match="outside of the folders") as caught:
            engine.apply(Load(name))
        assert f"'{name}'" in str(caught.value)
        assert str(allowed) in str(caught.value)
    assert facts(engine) == ()


@pytest.mark.parametrize("path", OUTSIDE)
def test_include_of_a_file_outside_is_refused(path: str, allowed: Path, engine: Engine) -> None:
    including = write(allowed / "including.lp", f'a.\n#include "{path}".')
    through = write(allowed / "sub" / "through.lp", '#include "../including.lp".')
    for command in (
        Load(including),
        Load(through),
        Add("p", (), f'#include "{allowed / path}".'),
        Add("p", (), f'#include "{including}".'),
        Add("p", (), f'#include "{through}".'),
        Add("p", (), f'#include "../allowed/{path}".'),
    ):
        with pytest.raises(ForbiddenError, match="outside of the folders"):
            engine.apply(command)
    assert facts(engine) == ()


def test_includes_that_cannot_be_read_beforehand_are_refused(allowed: Path, engine: Engine) -> None:
    secret = allowed.parent / "secret.lp"
    for text in (
        f'#script (python) "\n#end.\n#include "{secret}".',
        f'#script (python) %* #end. #include "{secret}".',
        f'"\n#include "{secret}".',
        f"#include {secret}.",
    ):
        with pytest.raises(RosclingoError):
            engine.apply(Add("p", (), text))
    assert facts(engine) == ()


@pytest.mark.parametrize(
    "text",
    ['#include "../work/a.lp".', '#include "a.lp".', '#include "missing.lp".'],
)
def test_an_included_file_that_is_not_there(text: str, engine: Engine) -> None:
    with pytest.raises(ProgramError, match="1:1"):
        engine.apply(Add("p", (), text))
    assert facts(engine) == ()


def test_what_is_inside_is_loaded(allowed: Path, engine: Engine) -> None:
    engine.apply(Load(str(allowed / "sub" / "inside.lp")))
    engine.apply(Load("../allowed/start.lp"))
    write(allowed / "a.lp", 'a. #include "sub/b.lp".')
    write(allowed / "sub" / "b.lp", 'b. #include "c.lp".')  # found next to b.lp
    write(allowed / "sub" / "c.lp", "c.")
    engine.apply(Load(str(allowed / "a.lp")))
    assert facts(engine) == ("a", "b", "c", "inside", "start")


def test_a_link_to_what_is_inside_is_followed(allowed: Path, engine: Engine) -> None:
    (allowed / "sub" / "link.lp").symlink_to(allowed / "start.lp")
    engine.apply(Load(str(allowed / "sub" / "link.lp")))
    assert facts(engine) == ("start",)


def test_files_that_include_each_other(allowed: Path, engine: Engine) -> None:
    write(allowed / "a.lp", 'a. #include "b.lp".')
    write(allowed / "b.lp", 'b. #include "a.lp".')
    engine.apply(Load(str(allowed / "a.lp")))
    assert facts(engine) == ("a", "b")


def test_the_default_folders(allowed: Path) -> None:
    # Those of the files given at start, and the working directory.
    engine = Engine(Options(files=(str(allowed / "start.lp"),)))
    write(Path("here.lp"), "here.")
    engine.apply(Load("here.lp"))
    engine.apply(Load(str(allowed / "sub" / "inside.lp")))
    with pytest.raises(ForbiddenError):
        engine.apply(Load(str(allowed / "link.lp")))
    assert facts(engine) == ("here", "inside", "start")


def test_an_empty_load_path_allows_nothing(allowed: Path) -> None:
    with pytest.raises(ForbiddenError, match=r"\(none\)"):
        Policy().check_file(str(allowed / "start.lp"))


def test_a_trusted_file_may_include_anything(allowed: Path) -> None:
    including = write(allowed / "including.lp", '#include "../secret.lp".')
    assert facts(Engine(Options(files=(including,)))) == ("secret",)


@pytest.mark.parametrize("name", ["missing.lp", "sub", "", "-", "x" * 5000])
def test_load_of_what_is_no_file(
    name: str, allowed: Path, engine: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(allowed)
    with pytest.raises(ProgramError, match="there is no file"):
        engine.apply(Load(name))
    assert facts(engine) == ()


def test_a_pipe_does_not_block(allowed: Path, engine: Engine, within: Within) -> None:
    pipe = allowed / "pipe.lp"
    os.mkfifo(pipe)  # nobody writes to it

    def load() -> List[str]:
        said = []
        for command in (Load(str(pipe)), Add("p", (), f'#include "{pipe}".')):
            with pytest.raises(ProgramError, match="there is no file") as caught:
                engine.apply(command)
            said.append(str(caught.value))
        return said

    assert within(20, load)


@pytest.mark.parametrize("name", ["a\0.lp", "\ud800.lp"], ids=ascii)
def test_load_of_a_name_that_no_file_can_have(name: str, engine: Engine) -> None:
    with pytest.raises(RosclingoError):
        engine.apply(Load(name))


def test_a_file_with_bad_content(allowed: Path, engine: Engine) -> None:
    for text, reason in (("a.\nb :- .c", "2:"), ("a\0.", "NUL"), ("a(" + "f(" * 9999, "nests")):
        path = write(allowed / "bad.lp", text)
        with pytest.raises(ProgramError, match=reason) as caught:
            engine.apply(Load(path))
        assert path in str(caught.value)
    assert facts(engine) == ()


# --- scripts ---------------------------------------------------------------------------------

SCRIPT = "#script (python)\nfrom clingo import Number\ndef f(): return Number(42)\n#end.\n"


def test_a_script_of_a_client_is_refused(allowed: Path, engine: Engine) -> None:
    path = write(allowed / "script.lp", "s.\n" + SCRIPT)
    for command, place in (
        (Add("p", (), SCRIPT), "<string>:1:1"),
        (Add("p", (), "a.\n  " + SCRIPT), "<string>:2:3"),
        (Add("p", (), "#script (lua) #end."), "<string>:1:1"),
        (Add("p", (), f'#include "{path}".'), f"{path}:2:1"),
        (Load(path), f"{path}:2:1"),
    ):
        with pytest.raises(ForbiddenError, match="allow_scripts") as caught:
            engine.apply(command)
        assert str(caught.value).startswith(place)
    engine.apply(Add("p", (), "a(@f())."))
    assert facts(engine, "p", "base") == ()


def test_a_script_does_not_run_while_it_is_refused(allowed: Path, engine: Engine) -> None:
    mark = allowed / "ran"
    with pytest.raises(ForbiddenError):
        engine.apply(Add("p", (), f"#script (python)\nopen({str(mark)!r}, 'w')\n#end."))
    assert not mark.exists()


def test_a_script_runs_when_it_is_allowed(allowed: Path) -> None:
    engine = Engine(Options(), Policy(allow_scripts=True, load_path=(str(allowed),)))
    engine.apply(Add("p", (), SCRIPT + "a(@f())."))
    assert facts(engine, "p") == ("a(42)",)
    engine.apply(Restart())
    engine.apply(Load(write(allowed / "script.lp", SCRIPT + "b(@f()).")))
    assert facts(engine) == ("b(42)",)


def test_scripts_are_forgotten_at_a_restart(scripting: Engine) -> None:
    scripting.apply(Add("p", (), SCRIPT))
    scripting.apply(Restart())
    scripting.apply(Add("q", (), "a(@f())."))
    assert facts(scripting, "q") == ()


def test_a_script_that_fails(scripting: Engine) -> None:
    with pytest.raises(ProgramError, match="ZeroDivisionError"):
        scripting.apply(Add("p", (), "#script (python)\n1/0\n#end."))
    scripting.apply(Restart())
    scripting.apply(Add("p", (), "a."))
    assert facts(scripting, "p") == ("a",)


def test_a_script_that_fails_leaves_nothing_behind(scripting: Engine) -> None:
    program = f"left(@f()). {SCRIPT} #script (python)\nraise ValueError('oops')\n#end. right."
    with pytest.raises(ProgramError) as caught:
        scripting.apply(Add("base", (), program))
    assert str(caught.value) == "ValueError: oops"
    scripting.apply(Add("base", (), "a(@f())."))
    assert facts(scripting) == ()


def test_a_function_that_fails_tells_no_paths(scripting: Engine) -> None:
    scripting.apply(Add("p", (), SCRIPT + "a(@f(1))."))
    with pytest.raises(SolverError, match=r"clingo failed: TypeError: f\(\) takes") as caught:
        scripting.apply(Ground((Part("p"),)))
    assert "Traceback" not in str(caught.value)
    assert ".py" not in str(caught.value)


def test_each_solver_has_its_own_scripts() -> None:
    engines = [Engine(Options(), Policy(allow_scripts=True)) for _ in range(3)]
    for i, engine in enumerate(engines):
        engine.apply(Add("p", (), SCRIPT.replace("42", str(i)) + "a(@f())."))
    engines[1].apply(Restart())
    assert facts(engines[0], "p") == ("a(0)",)
    assert facts(engines[2], "p") == ("a(2)",)
    engines[1].apply(Add("p", (), "a(@f())."))
    assert facts(engines[1], "p") == ()


@pytest.fixture
def leak(monkeypatch: pytest.MonkeyPatch) -> List[object]:
    """A function of the process's main module, which no program is to reach."""
    calls: List[object] = []
    main = sys.modules["__main__"]
    monkeypatch.setattr(main, "leak", lambda *arguments: calls.append(arguments), raising=False)
    return calls


def test_a_client_calls_what_trusted_scripts_define_and_nothing_else(
    allowed: Path, leak: List[object]
) -> None:
    start = write(allowed / "trusted.lp", "#script (python)\nimport os\n" + SCRIPT[17:])
    messages: List[str] = []
    engine = Engine(Options(files=(start,)), log=messages.append)
    names = ["exec", "eval", "open", "print", "main", "leak", "os", "__import__", "__builtins__"]
    calls = "".join(f'bad(@{name}("1")). bad(@{name}()).' for name in names)
    engine.apply(Add("p", (), f"a(@f()). {calls}"))
    assert facts(engine, "p", "base") == ("a(42)",)
    assert leak == []
    said = "\n".join(messages)
    for name in names:
        assert f"function '{name}' not found" in said


# --- parsing and checking --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("a :- b", "2:1"),
        ("a.\nb c.", "2:3"),
        ('a("x).', "1:3"),
        ("a(X).", "1:1"),
        ("a.\n  b(X) :- not c(X).", "2:3"),
        ("&x { 1 }.", "1:2"),
        ("#const n=1. #const n=2.", "1:13"),
        ("a.\nä.", "2:1"),
        ("a. € b.", "1:4"),
        ("#include x.", "line 1"),
        ("a\0.", "NUL"),
        ("a(\ud800).", "Unicode"),
        ("asp 1 0 0\n0\n", "line 1: this is a ground program"),  # else it would be an empty one
        ("a.\n#include <incmode>.", "line 2, column 1"),
    ],
    ids=ascii,
)
def test_a_wrong_program_is_refused_with_its_place(text: str, place: str) -> None:
    engine = Engine(Options())
    with pytest.raises(ProgramError) as caught:
        engine.apply(Add("p", (), text))
    assert place in str(caught.value)
    engine.apply(Add("p", (), "good."))  # and the solver is as good as before
    assert facts(engine, "p") == ("good",)


@pytest.mark.parametrize("name", ["", "P", "1", "p q", "p(t)", "p.", "_", "#p", "ä", "p\n", "a\0"])
def test_names_that_are_no_identifiers(name: str) -> None:
    for part, parameters in ((name, ()), ("p", ("t", name))):
        with pytest.raises(ProgramError, match="is not an identifier"):
            programs.parse_part(part, parameters, "a.")


def test_parts() -> None:
    program = programs.parse_part("p", ("s", "t"), "a. #program q(x). b. #program base. c.")
    assert program.parts.keys() == {("base", 0), ("p", 2), ("q", 1)}


def test_statements_belong_to_their_files(tmp_path: Path) -> None:
    """Also after an include in the middle of a part, where clingo begins base again."""
    texts = {
        "a.lp": 'a. #program p. b. #include "sub/b.lp". c. #program q. d.',
        "sub/b.lp": 'e. #program r. #external f(1). #include "c.lp". g. #external -h : a.',
        "sub/c.lp": "#program p. i.",
        "d.lp": "j. #program q. k. #external l(1;2,3). % #external m.",
        "e.lp": "",
    }
    (tmp_path / "sub").mkdir()
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    names = [str(tmp_path / name) for name in ("a.lp", "e.lp", "d.lp")]
    for files in (names, names[::-1]):
        program = programs.parse_files(files)
        assert {part: {Path(file).name for file in of} for part, of in program.parts.items()} == {
            ("base", 0): {"a.lp", "b.lp", "d.lp"},
            ("p", 0): {"a.lp", "b.lp", "c.lp"},
            ("q", 0): {"a.lp", "d.lp"},
            ("r", 0): {"b.lp"},
        }
        assert {("f", 1, True), ("h", 0, False)} <= program.externals


def test_definitions_are_constants_and_theories() -> None:
    text = "#const n=1. a(n). #theory t { x {}; &y/0 : x, any }."
    program = programs.parse_part("p", (), text)
    assert [str(statement).split()[0] for statement in program.definitions] == [
        "#const",
        "#theory",
    ]


def test_check_uses_what_is_known() -> None:
    theory = programs.parse_part("p", (), "#theory t { x {}; &y/0 : x, any }.")
    atom = programs.parse_part("q", (), "&y { a }.")
    with pytest.raises(ProgramError, match="no definition found for theory atom"):
        programs.check(atom, (), Options())
    programs.check(atom, theory.definitions, Options())


def test_no_files_do_not_read_standard_input() -> None:
    assert programs.parse_files([]).statements == []


def test_a_trusted_file_that_is_wrong(allowed: Path) -> None:
    path = write(allowed / "wrong.lp", "a.\nb :- X.")
    with pytest.raises(ProgramError) as caught:
        Engine(Options(files=(path,)))
    assert f"{path}:2:" in str(caught.value)


def test_a_trusted_file_with_a_main_loop_is_taken_without_it(allowed: Path) -> None:
    path = write(allowed / "inc.lp", "#include <incmode>. a.")
    remarks: List[str] = []
    engine = Engine(Options(files=(path,)), log=remarks.append)
    assert facts(engine, "base") == ("a",)
    engine.apply(Restart())
    assert remarks == [
        f"{path}: warning: the main loop of #include <incmode> is not used; clients ground and "
        "solve"
    ]


def test_an_option_that_clingo_refuses() -> None:
    with pytest.raises(OptionsError, match="--nonsense"):
        programs.new_control(["--nonsense"], ClingoMessages())


# --- what a client sends must not end the process --------------------------------------------


@pytest.mark.parametrize(
    "text",
    [
        "ä(ö) :- ü.",
        'a("ä"). b(ä).',
        "a(1\\0). a(1/0).",
        "a(X) :- X = 1..3, X \\ 0 = 1.",
        '#script (python)\n#" #end. a(' + "-" * 1_500_000 + '1). %"',
    ],
    ids=lambda text: ascii(text[:45]),
)
def test_a_program_does_not_end_the_process(text: str, run_python: Callable[..., str]) -> None:
    # In the worker, as in the node.
    code = (
        "import sys\n"
        "from rosclingo.wire.commands import Add, Ground, Part, Restart\n"
        "from rosclingo.solver.engine import Engine\n"
        "from rosclingo.solver.options import Options\n"
        "from rosclingo.solver.worker import Worker\n"
        "worker = Worker(Engine(Options()))\n"
        "worker.control([Add('p', (), eval(sys.stdin.read())), Ground((Part('p'),))])\n"
        "print(worker.control([Restart(), Ground((Part('base'),))]).success)"
    )
    assert run_python(code, repr(text)) == "True"


@pytest.mark.parametrize("begin", ["", "%#script\n", '"#script'])
def test_open_strings_take_no_longer_than_closed_ones(
    begin: str, run_python: Callable[..., str]
) -> None:
    # Hours if what is behind each quote is read to the text's end, here or in clingo.
    code = (
        "from rosclingo.wire.commands import Add\n"
        "from rosclingo.solver.engine import Engine\n"
        "from rosclingo.solver.options import Options\n"
        f"program = {begin!r} + '\"' + '\\\\\"' * 1_000_000\n"
        "print(Engine(Options()).run([Add('p', (), program)]).failure.message)"
    )
    assert "the string does not end" in run_python(code)
