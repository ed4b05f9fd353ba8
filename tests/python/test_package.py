"""The package: its files, its stubs, and the texts of its objects."""

import ast
import inspect
import re
import textwrap
from pathlib import Path

import dynains
import pytest

FOLDER = Path(dynains.__file__).parent
STUBS = ast.parse((FOLDER / "__init__.pyi").read_text())


def public(names):
    return {name for name in names if not name.startswith("_")}


def definitions(body):
    """Name -> definitions of functions, properties and classes in the stubs."""
    found = {}
    for node in body:
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            found.setdefault(node.name, []).append(node)
        elif isinstance(node, ast.AnnAssign):
            found[node.target.id] = [node]
        elif isinstance(node, ast.Assign):
            found[node.targets[0].id] = [node]
    return found


CLASSES = [node for node in STUBS.body if isinstance(node, ast.ClassDef)]
FUNCTIONS = [node for node in STUBS.body if isinstance(node, ast.FunctionDef)]


def is_property(node):
    if isinstance(node, ast.AnnAssign):
        return True
    return any(getattr(d, "id", "") == "property" for d in node.decorator_list)


def signatures(function):
    """Each overload of a function: its arguments as ast; for a compiled one, from its text."""
    name = function.__name__
    if inspect.isfunction(function):
        return [ast.parse(textwrap.dedent(inspect.getsource(function))).body[0].args]
    lines = re.findall(rf"^(?:\d+\. )?({name}\(.*\) -> .*)$", function.__doc__, re.MULTILINE)
    if len(lines) > 1:
        lines = lines[1:] if "*args" in lines[0] else lines
    return [ast.parse(f"def {line}: ...").body[0].args for line in lines]


def named_in(text):
    """Keyword arguments that a docstring lists, one a line."""
    return re.findall(r"^  (\w+): ", text, re.MULTILINE)


def assert_same_arguments(stub, args, keywords, where):
    arguments = stub.args
    names = [a.arg for a in arguments.args]
    assert names == [a.arg for a in args.args], where
    for ours, theirs in zip(arguments.defaults, args.defaults):
        assert ast.literal_eval(ours) == ast.literal_eval(theirs), where
    assert len(arguments.defaults) == len(args.defaults), where
    assert bool(arguments.kwonlyargs) == bool(args.kwarg), where
    assert [a.arg for a in arguments.kwonlyargs] == (keywords if args.kwarg else []), where


def assert_same_function(stubs, function, keywords, where):
    found = signatures(function)
    assert len(stubs) == len(found), where
    for stub, args in zip(stubs, found):
        assert_same_arguments(stub, args, keywords, where)


def test_the_package_is_typed():
    assert (FOLDER / "py.typed").exists()


def test_stubs_have_the_names_of_the_module():
    submodules = {name for name, value in vars(dynains).items() if inspect.ismodule(value)}
    assert public(definitions(STUBS.body)) == public(vars(dynains)) - submodules


@pytest.mark.parametrize("node", CLASSES, ids=lambda node: node.name)
def test_stubs_of_a_class_are_those_of_the_module(node):
    bound = getattr(dynains, node.name)
    assert [ast.unparse(base) for base in node.bases] in (
        [],
        [base.__name__ for base in bound.__bases__],
    )
    if issubclass(bound, Exception):
        return
    stubs = definitions(node.body)
    members = public(vars(bound))
    if issubclass(bound, int):
        assert public(stubs) == set(bound.__members__)
        return
    assert public(stubs) == members
    parameters = [parameter["name"] for parameter in dynains.Config.parameters()]
    for name, nodes in stubs.items():
        value = getattr(bound, name)
        where = f"{node.name}.{name}"
        if is_property(nodes[0]):
            assert isinstance(vars(bound)[name], property), where
        else:
            keywords = named_in(bound.__doc__) or parameters
            assert_same_function(nodes, value, keywords, where)


@pytest.mark.parametrize("node", FUNCTIONS, ids=lambda node: node.name)
def test_stubs_of_a_function_are_those_of_the_module(node):
    function = getattr(dynains, node.name)
    assert_same_function([node], function, named_in(function.__doc__), node.name)


def test_types_of_parameters():
    (config,) = [node for node in CLASSES if node.name == "Config"]
    types = {
        node.target.id: ast.unparse(node.annotation)
        for node in config.body
        if isinstance(node, ast.AnnAssign)
    }
    for parameter in dynains.Config.parameters():
        expected = type(parameter["default"]).__name__
        if parameter["values"]:
            expected = ast.unparse(ast.parse(f"Literal[{str(parameter['values'])[1:-1]}]"))
        assert types[parameter["name"]] == expected


def test_every_object_says_what_it_holds(street):
    remover = dynains.DynaInsRemover(window=6)
    frame = remover.push(street[0].points, street[0].T_world_sensor, 0.5)
    count = len(street[0].points)
    assert re.fullmatch(
        rf"<dynains.ScanVerdict: scan 0 at 0.5 s, {count} points, \d+ dynamic>", repr(frame.newest)
    )
    assert repr(frame) == f"<dynains.FrameResult: newest {frame.newest!r}, finished None>"
    assert repr(remover) == (
        f"<dynains.DynaInsRemover: {remover.map_size} points on the map, dynains.Config(window=6)>"
    )
