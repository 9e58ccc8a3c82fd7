"""The options of the command line and REST are those of `kin.IKOptions`."""

from __future__ import annotations

import re
import subprocess
import sys
from typing import Any, get_type_hints

import pytest

from app.cli.arguments.options import flag_of
from app.shared.options import declared
from kin import IKOptions, JointConstraints
from kin.ik.options import DEFAULTS

HINTS: dict[str, Any] = {
    **get_type_hints(JointConstraints, include_extras=True),
    **get_type_hints(IKOptions, include_extras=True),
}


def test_every_option_is_declared_with_its_default_and_a_text():
    assert list(declared()) == list(DEFAULTS)
    for name, option in declared().items():
        assert option.default == (DEFAULTS[name] or option.default), name
        assert option.text[-1] not in " .", name


def test_a_command_without_such_options_does_not_import_the_core_for_its_help():
    program = 'import sys, app.cli.parser as cli; cli.main(["fk", "--help"]); print("kin" in sys.modules)'
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("\nFalse\n")


@pytest.mark.parametrize("request_name", ["IkRequest", "SentIkRequest"])
def test_rest_describes_every_option_in_the_words_of_the_class(app, request_name):
    fields = app.openapi()["components"]["schemas"][request_name]["properties"]
    for name, option in declared().items():
        start = option.text.partition(". ")[0]
        assert start[1:] in fields[name]["description"], name
        if option.choices and name != "task":
            assert fields[name]["enum"] == list(option.choices)
            assert fields[name]["default"] == DEFAULTS[name]
        if option.unit:
            (allowed,) = HINTS[name].__metadata__
            number = fields[name]["anyOf"][0]
            assert (number["minimum"], number["maximum"]) == (allowed.least, allowed.most)


def test_the_command_line_has_a_flag_for_every_option(capsys):
    from app.cli import parser

    assert parser.main(["ik", "--help"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    for name, option in declared().items():
        if name == "respect_limits":  # its flag says the opposite
            assert "--ignore-limits" in text
            continue
        assert f" {flag_of(name)} " in text, name
        assert option.text.partition(",")[0].partition(".")[0] in text, name
    assert "`" not in re.sub("`(kinboard|pip) [^`]+`", "", text.partition("options:")[2]), "names of options"
