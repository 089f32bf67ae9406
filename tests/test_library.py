"""The C core of the installed package is found from the sources of a clone, if it is of the same sources."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest

import athcodec
from athcodec._library import LIBRARY_NAME, library_path

ROOT = Path(__file__).resolve().parent.parent
SITE = Path(sysconfig.get_path("purelib"))
PATH = "import athcodec._library as library; print(library.library_path())"


def in_clone(*arguments: str, site: Path | None) -> subprocess.CompletedProcess:
    """Run Python in the clone's folder, with the packages of a folder and of this environment, but without what makes
    an editable install known to Python: as if the package had been installed without `-e`."""
    folders = [] if site is None else [str(site), str(SITE)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(folders), "PYTHONSAFEPATH": ""}
    command = [sys.executable, "-S", *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=ROOT, env=environment, timeout=60)


def refusal(done: subprocess.CompletedProcess) -> str:
    """The message of the ImportError that a run ended with."""
    assert done.returncode == 1 and done.stderr.splitlines()[-1].startswith("ImportError: "), done
    return done.stderr.splitlines()[-1]


@pytest.fixture
def installed(tmp_path):
    """A function that installs a package without `-e`: the library, its version, and the bindings beside it."""

    def install(version: str = athcodec.__version__, bindings: bytes | None = None) -> Path:
        facts = tmp_path / f"athcodec-{version}.dist-info"
        facts.mkdir()
        (facts / "METADATA").write_text(f"Metadata-Version: 2.1\nName: athcodec\nVersion: {version}\n")
        package = tmp_path / "athcodec"
        package.mkdir()
        (package / LIBRARY_NAME).symlink_to(library_path())
        (package / "_native.py").write_bytes(bindings or (ROOT / "athcodec" / "_native.py").read_bytes())
        return tmp_path

    return install


@pytest.mark.parametrize(
    "arguments, printed",
    [
        (("-c", "import athcodec, athcodec._native; print(athcodec.__file__)"), str(ROOT / "athcodec" / "__init__.py")),
        (("-m", "athcodec", "info", "--json", str(ROOT / "athcodec" / "sample" / "grass.ath")), '"vertices": 1400'),
        (("-c", "import bench, athcodec; print(athcodec.__file__)"), str(ROOT / "athcodec" / "__init__.py")),
    ],
    ids=["python -c", "python -m athcodec", "bench"],
)
def test_the_sources_in_the_clone_run_with_the_library_of_the_installed_package(arguments, printed, installed):
    done = in_clone(*arguments, site=installed())
    assert done.returncode == 0 and printed in done.stdout, done.stderr


def test_the_library_is_that_of_the_installed_package(installed):
    site = installed()
    assert in_clone("-c", PATH, site=site).stdout.strip() == str(site / "athcodec" / LIBRARY_NAME)


def test_without_an_installed_package_the_message_names_what_was_looked_at_and_the_command_that_builds_it():
    message = refusal(in_clone("-c", PATH, site=None))
    assert f"no {LIBRARY_NAME} in {ROOT / 'athcodec'}" in message
    assert f"no athcodec installed for {sys.executable}" in message
    assert f'`{sys.executable} -m pip install "{ROOT}"`' in message


def test_an_installed_package_without_a_library_is_named(installed):
    site = installed()
    (site / "athcodec" / LIBRARY_NAME).unlink()
    message = refusal(in_clone("-c", PATH, site=site))
    assert f"nor in {site / 'athcodec'}, where athcodec {athcodec.__version__} is installed" in message


def test_a_library_of_another_version_is_refused_with_both_versions_and_both_places(installed):
    site = installed("9.8.7")
    message = refusal(in_clone("-c", PATH, site=site))
    assert str(site / "athcodec" / LIBRARY_NAME) in message and str(ROOT / "athcodec") in message
    assert f"got version 9.8.7, expected {athcodec.__version__}" in message
    assert f'`{sys.executable} -m pip install "{ROOT}"`' in message


def test_a_library_of_the_same_version_that_was_installed_with_other_bindings_is_refused(installed):
    site = installed(bindings=b"# of another commit\n")
    message = refusal(in_clone("-c", PATH, site=site))
    assert str(site / "athcodec" / LIBRARY_NAME) in message and "another _native.py" in message


def test_a_library_that_lacks_a_function_is_refused_by_name(installed):
    site = installed()
    library = site / "athcodec" / LIBRARY_NAME
    library.unlink()
    subprocess.run(["cc", "-shared", "-o", library, "-xc", os.devnull], check=True)
    message = refusal(in_clone("-c", "import athcodec._native", site=site))
    assert str(library) in message and "without ath_result_name()" in message
