"""Policies: which reaction to which contact, by name, by rule and from a file."""

from pathlib import Path

import pytest

from tactful.config import ConfigError
from tactful.errors import TactfulError
from tactful.reaction import NAMED, ReactionConfig, Rule, load_policy
from tests.reaction._events import told


@pytest.mark.parametrize(
    ("policy", "kind", "reaction"),
    [
        ("continue", "collision", "continue"),
        ("stop", "collision", "stop"),
        ("stop", "contact", "stop"),
        ("stop", "cooperation", "continue"),
        ("retract", "contact", "stop"),
        ("retract", "collision", "retract"),
        ("retract", "expected_impact", "continue"),
        ("comply", "cooperation", "comply"),
        ("teach", "cooperation", "teach"),
        ("teach", "unexpected_impact", "stop"),
    ],
)
def test_named_policies(policy: str, kind: str, reaction: str) -> None:
    """The names on the command line are a promise of what an arm does."""
    assert load_policy(policy).choose(told(kind)) == reaction


def test_first_rule_that_holds_decides() -> None:
    """Rules are read from above, as a firewall's are, so that an exception can stand before the rule."""
    rules = (
        Rule(kind="collision", confidence=0.9, reaction="retract"),
        Rule(kind="collision", reaction="stop"),
        Rule(reason="early", reaction="comply"),
    )
    policy = ReactionConfig(rules=rules)
    assert policy.choose(told(confidence=0.95)) == "retract"
    assert policy.choose(told(confidence=0.5)) == "stop"
    assert policy.choose(told("unexpected_impact")) == "continue"
    assert policy.choose(told("unexpected_impact", reason="early")) == "comply"


def test_policy_from_a_file(tmp_path: Path) -> None:
    """A cell's own policy is a file, and what it does not say stays as it is."""
    file = tmp_path / "policy.toml"
    file.write_text('retract_m = 0.1\n[[rules]]\nkind = "collision"\nreaction = "retract"\n')
    policy = load_policy(file)
    assert policy.choose(told()) == "retract"
    assert policy.retract_m == 0.1
    assert policy.retract_s == NAMED["retract"].retract_s


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[[rules]]\nkind = "bump"\nreaction = "stop"\n', "kind"),
        ('[[rules]]\nreaction = "flee"\n', "reaction"),
        ("retract = 1\n", "unknown key; did you mean 'retract_"),
        ("torque_share = 1.5\n", "torque_share"),
    ],
)
def test_bad_policy_is_told(tmp_path: Path, text: str, message: str) -> None:
    """A slip in a policy must not become a motion."""
    file = tmp_path / "policy.toml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=message):
        load_policy(file)


def test_unknown_name_is_told() -> None:
    """A misspelt name lists the names."""
    with pytest.raises(TactfulError, match="no reaction is called 'stopp': use continue, stop"):
        load_policy("stopp")
