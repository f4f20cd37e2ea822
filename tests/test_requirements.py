"""The oldest versions that are tested are those that setup.cfg allows."""

import configparser
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_the_oldest_versions_tested_are_the_oldest_allowed():
    setup = configparser.ConfigParser()
    setup.read(ROOT / "setup.cfg")
    required = [
        setup["options"]["install_requires"],
        *(setup["options.extras_require"][e] for e in ("test", "parquet")),
    ]
    allowed = dict(re.findall(r"^([\w-]+) >= ([\w.]+)", "\n".join(required), re.MULTILINE))
    tested = dict(re.findall(r"^([\w-]+)==([\w.]+)", (ROOT / ".ci" / "oldest.txt").read_text(), re.MULTILINE))
    assert allowed.keys() == tested.keys()
    for name, version in allowed.items():
        assert tested[name] == version or re.fullmatch(re.escape(version) + r"(\.0)+", tested[name]), name
