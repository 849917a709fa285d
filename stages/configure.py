"""Check params.yaml and write one configuration file a stage: data/<subject>/config/<stage>.json."""

from __future__ import annotations

from facefolds_core.files import atomic_folder
from facefolds_core.params_file import load_params, write_configs
from facefolds_core.paths import SubjectFolders
from facefolds_core.reading import check_local
from stages.common import run_stage


def configure(folders: SubjectFolders) -> str:
    params = load_params("params.yaml")
    subject = params.subjects.get(folders.root.name)
    if subject is not None:
        check_local(subject.path, f"subjects.{folders.root.name}.path")
    with atomic_folder(folders.config) as temporary:
        count = len(write_configs(params, folders.root.name, temporary))
    return f"{count} files in {folders.config}"


if __name__ == "__main__":
    run_stage("configure", configure, __doc__ or "")
