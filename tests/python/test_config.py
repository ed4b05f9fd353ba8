import copy
import pickle

import dynains
import numpy as np
import pytest


def test_every_parameter_is_an_attribute_with_its_default_and_help():
    config = dynains.Config()
    parameters = dynains.Config.parameters()
    names = [parameter["name"] for parameter in parameters]
    assert {"window", "tau_s", "map_voxel", "use_belief"} <= set(names)
    assert len(names) == len(set(names))
    assert config.to_dict() == {p["name"]: p["default"] for p in parameters}
    for parameter in parameters:
        name = parameter["name"]
        assert getattr(config, name) == parameter["default"]
        assert parameter["help"] in getattr(dynains.Config, name).__doc__
        assert parameter["section"]
        setattr(config, name, parameter["default"])
    assert config == dynains.Config()


def test_parameters_are_set_by_name():
    config = dynains.Config(window=6, use_belief=False)
    config.tau_s = 0.25
    assert (config.window, config.use_belief, config.tau_s) == (6, False, 0.25)
    assert config != dynains.Config()
    text = repr(config)
    assert "window=6" in text and "tau_s=0.25" in text and "min_range" not in text
    assert eval(text, {"dynains": dynains}) == config
    assert dynains.DynaInsRemover(config).config == config
    assert dynains.DynaInsRemover(window=6).config.window == 6


def test_the_configuration_of_a_remover_is_a_copy():
    remover = dynains.DynaInsRemover()
    remover.config.window = 9
    assert remover.config.window == dynains.Config().window


@pytest.mark.parametrize(
    "values, text",
    [
        ({"tau_s": 1.5}, r"tau_s = 1.5: expected FLOAT in \[0, 1\]"),
        ({"tau_s": float("nan")}, "tau_s = nan"),
        ({"window": 1000}, "window = 1000"),
        ({"window": 4.5}, "window = 4.5: expected INT"),
        ({"tau_s": "high"}, "expected FLOAT"),
        ({"level": 0.5}, "level = 0.5: expected true"),
        ({"tau": 0.5}, "unknown parameter tau$"),
        ({"decision": "paper"}, r"expected window\|free_space"),
        ({"decision": 1}, "decision = 1: expected window"),
    ],
)
def test_bad_values_are_refused(values, text):
    with pytest.raises(dynains.ConfigError, match=text):
        dynains.Config(**values)
    with pytest.raises(dynains.ConfigError, match=text):
        dynains.DynaInsRemover(**values)


def test_contradictions_are_refused():
    config = dynains.Config(min_range=50, max_range=40)
    with pytest.raises(dynains.ConfigError, match="min_range"):
        config.validate()
    with pytest.raises(dynains.ConfigError, match="min_range"):
        dynains.DynaInsRemover(config)


def test_configs_are_compared_and_copied_as_values():
    config = dynains.Config(window=6, level=np.bool_(False))
    assert config == dynains.Config(window=6, level=False)
    assert config != dynains.Config(window=6)
    assert config != 6
    assert config != None  # noqa: E711
    assert config not in [None, "window"]
    assert copy.deepcopy(config) == config
    assert pickle.loads(pickle.dumps(config)) == config


def test_a_misspelt_attribute_is_an_error():
    with pytest.raises(AttributeError):
        dynains.Config().tau = 0.5


def test_a_parameter_with_named_values_is_a_text():
    config = dynains.Config(decision="window")
    assert config.decision == "window" and "decision='window'" in repr(config)
    (entry,) = [p for p in dynains.Config.parameters() if p["name"] == "decision"]
    assert entry["values"] == ["window", "free_space"]
    assert dynains.Config.paper().decision == "window"
    assert pickle.loads(pickle.dumps(config)) == config


def test_every_class_has_a_text_of_its_own():
    for name, thing in vars(dynains).items():
        if isinstance(thing, type) and not issubclass(thing, (Exception, int)):
            assert "__repr__" in vars(thing), name


def test_everything_public_has_a_docstring():
    for name, thing in vars(dynains).items():
        if name.startswith("_"):
            continue
        assert thing.__doc__, name
        if isinstance(thing, type):
            for member, value in vars(thing).items():
                if not member.startswith("_") and not isinstance(value, thing):
                    assert value.__doc__, f"{name}.{member}"


def test_errors_are_value_errors():
    for error in (dynains.ConfigError, dynains.PoseError, dynains.CloudError):
        assert issubclass(error, ValueError)
