"""Check params.yaml; write one configuration file a stage and subject, and digests of each stage's code.

It writes data/.config/<subject>/<stage>.json and data/.code/<stage>.json, of all subjects: it takes as long as for one,
and no stage of any subject runs before every name and value is checked.
"""

from __future__ import annotations

from pathlib import Path

from facefolds_core.config.params_file import load_params, write_configs
from facefolds_core.config.source_code import digests_of_stages
from facefolds_core.files.paths import SubjectFolders, check_place
from facefolds_core.files.writing import atomic_folder, write_json
from facefolds_core.params import STAGE_SECTIONS
from stages.common import run_for_all

ROOT = Path(__file__).resolve().parents[1]


def configure(data: Path) -> str:
    """Write all subjects' files below `data`; returns a line that says what was made."""
    params = load_params("params.yaml")
    for name, subject in params.subjects.items():
        named = {"mattes": subject.mattes, "start": subject.start}
        if not subject.is_generated:
            named["path"] = subject.path
        for key, path in named.items():
            if path is not None:
                check_place(path, SubjectFolders(data / name), key)
    code = digests_of_stages(ROOT, STAGE_SECTIONS)
    with atomic_folder(data / ".config") as temporary:
        for name in params.subjects:
            write_configs(params, name, temporary / name)
    with atomic_folder(data / ".code") as temporary:
        for stage, digests in code.items():
            write_json(temporary / f"{stage}.json", digests)
    return f"{len(params.subjects)} subjects in {data / '.config'}"


if __name__ == "__main__":
    run_for_all("configure", configure, __doc__ or "")
