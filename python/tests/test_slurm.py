"""The scripts of samples/slurm on a Slurm of one node, which is started for them and ended after them."""

from __future__ import annotations

import os
import pathlib
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

import glasswarp as gw

SCRIPTS = pathlib.Path(__file__).parents[2] / "samples" / "slurm"
DAEMONS = ("munged", "slurmctld", "slurmd", "sbatch", "scontrol")

CONFIG = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
SlurmdSpoolDir={folder}/spool
StateSaveLocation={folder}/state
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
ReturnToService=2
SchedulerParameters=sched_interval=1,batch_sched_delay=0
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def free_ports(count: int) -> list[int]:
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [int(one.getsockname()[1]) for one in sockets]
    for one in sockets:
        one.close()
    return ports


@pytest.fixture(scope="module")
def slurm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, str]]:
    """The environment in which `sbatch` finds the cluster."""
    path = os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/sbin"])
    if any(shutil.which(one, path=path) is None for one in DAEMONS) or os.geteuid() != 0:
        pytest.skip("Slurm is not installed, or this is not root, who starts it")
    folder = tmp_path_factory.mktemp("slurm")
    (folder / "state").mkdir()
    (folder / "spool").mkdir()
    key = folder / "munge.key"
    key.write_bytes(os.urandom(128))
    key.chmod(0o600)
    for one in (folder, *list(folder.parents)[:2]):
        one.chmod(0o755)
    host = socket.gethostname().split(".")[0]
    config = CONFIG.format(folder=folder, host=host, ports=free_ports(2), cpus=os.cpu_count())
    (folder / "slurm.conf").write_text(config)
    command = pathlib.Path(sys.executable).parent
    environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf"), "PATH": f"{command}{os.pathsep}{path}"}
    daemons = [
        [
            *("munged", "--foreground", "--force", f"--key-file={key}", f"--socket={folder}/munge.socket"),
            *(f"--pid-file={folder}/munge.pid", f"--log-file={folder}/munge.log", f"--seed-file={folder}/munge.seed"),
        ],
        ["slurmctld", "-D"],
        ["slurmd", "-D", "-N", host],
    ]
    running: list[subprocess.Popen[bytes]] = []
    try:
        for daemon in daemons:
            log = (folder / f"{daemon[0]}.out").open("wb")
            running.append(subprocess.Popen(daemon, env=environment, stdout=log, stderr=log))
            log.close()
            time.sleep(1.0)
        for _ in range(120):
            node = subprocess.run(["sinfo", "-h", "-o", "%T"], env=environment, capture_output=True, text=True)
            if node.stdout.strip() in ("idle", "mixed"):
                break
            time.sleep(0.5)
        else:
            logs = "\n".join(one.read_text(errors="replace")[-2000:] for one in sorted(folder.glob("*.out")))
            pytest.fail(f"no node is up: {node.stdout}{node.stderr}\n{logs}")
        yield environment
    finally:
        for process in reversed(running):
            process.terminate()
            process.wait()


def submitted(slurm: dict[str, str], folder: pathlib.Path, *words: str) -> str:
    """Submits a script and waits for it; returns the job."""
    made = subprocess.run(["sbatch", "--parsable", "--wait", *words], env=slurm, cwd=folder, capture_output=True, text=True)
    outputs = "\n".join(f"{one.name}: {one.read_text()}" for one in sorted(folder.glob("slurm-*.out")))
    assert made.returncode == 0, made.stdout + made.stderr + outputs
    return made.stdout.strip()


def test_an_array_of_photon_shards_gives_what_one_run_gives(
    slurm: dict[str, str], block: gw.Block, tmp_path: pathlib.Path
) -> None:
    block.save(tmp_path / "b.stl")
    gw.photons(tmp_path / "b.stl", tmp_path / "one.exr", photons=500_000)
    photons = str(SCRIPTS / "photons.sbatch")
    # A part is missing at first: the merge says so, and the same command makes what is missing.
    submitted(slurm, tmp_path, "--array=1-4", photons, "b.stl", "500000", "parts")
    (tmp_path / "parts" / "part-3-of-4.exr").unlink()
    merge = ["sbatch", "--wait", str(SCRIPTS / "merge.sbatch"), "parts", "all.exr"]
    assert subprocess.run(merge, env=slurm, cwd=tmp_path, capture_output=True).returncode != 0
    submitted(slurm, tmp_path, "--array=1-4", photons, "b.stl", "500000", "parts")
    submitted(slurm, tmp_path, *merge[2:])
    assert (tmp_path / "all.exr").read_bytes() == (tmp_path / "one.exr").read_bytes()


def test_an_array_of_designs_makes_every_block(
    slurm: dict[str, str], picture: pathlib.Path, tmp_path: pathlib.Path
) -> None:
    for name, distance in (("near", 200), ("far", 400)):
        text = f'[design]\npicture = "{picture}"\nnodes = 33\nsource-size = "none"\ndistance = "{distance}mm"\n'
        (tmp_path / f"{name}.toml").write_text(text)
    (tmp_path / "panes.txt").write_text("near.toml\nfar.toml\n")
    submitted(slurm, tmp_path, "--array=1-2", str(SCRIPTS / "designs.sbatch"), "panes.txt", "blocks")
    for name, distance in (("near", 200), ("far", 400)):
        assert (tmp_path / "blocks" / name / f"{name}.json").exists()
        here = tmp_path / "here" / f"{name}.stl"
        here.parent.mkdir(exist_ok=True)
        gw.design(picture, nodes=33, source_size="none", distance_mm=distance).save(here)
        assert (tmp_path / "blocks" / name / f"{name}.stl").read_bytes() == here.read_bytes()
