"""Work by executors: the answers of one process, workers that die, Ctrl-C, and what no executor can do."""

import multiprocessing
import os
import pickle
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from threadpoolctl import threadpool_info

import vpm
from synthetic import Truth, nominal, simulate_axis
from task_work import die, double, late, slow
from two_link_arm import Arm, record
from two_link_arm import nominal as arm
from vpm import demo, sending, tasks
from vpm.errors import ExecutorError
from vpm.many_diagnoses import Case, diagnose_many
from vpm.one_thread import ONE_THREAD
from vpm.simplify.judge import Judge
from vpm.simplify.reductions import reductions
from vpm.simplify.trials import Trials
from vpm.tasks import BatchInterruptedError, outcomes, processes

#: A diagnosis of a fifth of a second.
QUICK: dict[str, Any] = {"effects": ["coulomb_friction"], "limit": 1, "check": False}


@pytest.fixture
def pool() -> Iterator[Executor]:
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
        yield executor


def cases(folder: Path, count: int) -> list[Case]:
    """Axes with dry friction in files, and one whose record has too little in it."""
    found = []
    for seed in range(count):
        logs = simulate_axis(Truth(coulomb=4.0 + 0.1 * seed), 2, 1.0, 2 * seed)
        loaded = [vpm.Experiment.load(log.to_csv(folder / f"{seed}_{n}.csv")) for n, log in enumerate(logs)]
        found.append(Case(nominal(), loaded[0], loaded[1], f"axis {seed}"))
    few = found[0].records[0][0].select(["axis.position"])
    return [*found, Case(nominal(), few, name="few channels")]


def bare(answer: object) -> object:
    """An answer without what no two have in common: times of day, and those that it took."""
    if not isinstance(answer, vpm.Diagnosis):
        return type(answer), str(answer)
    assert answer.provenance is not None
    return replace(answer, seconds=0.0, provenance=replace(answer.provenance, date=""))


def same(found: Sequence[object], alone: Sequence[object]) -> bool:
    return [bare(one) for one in found] == [bare(one) for one in alone]


def children(executor: Any) -> list[int]:
    return [process.pid for process in executor._processes.values()]


def killing(pids: Callable[[], list[int]], said: list[str]) -> Callable[[str], None]:
    """Listener that ends a worker when it hears of the first answer."""

    def tell(sentence: str) -> None:
        said.append(sentence)
        if len(said) == 1:
            os.kill(pids()[0], signal.SIGKILL)

    return tell


def test_each_of_many_diagnoses_is_that_of_one_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    todo, said = cases(Path(), 2), list[str]()
    alone = [vpm.diagnose(case.model, case.experiments, case.validate, **QUICK) for case in todo[:2]]
    here = diagnose_many(todo, tell=said.append, **QUICK)
    assert same(here[:2], alone)
    assert isinstance(here[2], vpm.VpmError)
    assert [line.partition(" ")[0] for line in said] == ["1/3", "2/3", "3/3"]
    assert "coulomb_friction at axis" in said[0]
    with ThreadPoolExecutor(2) as threads:
        assert same(diagnose_many(todo, executor=threads, **QUICK), here)


def test_a_killed_worker_of_a_pool_loses_nothing(tmp_path: Path) -> None:
    todo, said = cases(tmp_path, 3), list[str]()
    alone = diagnose_many(todo, **QUICK)
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as executor:
        found = diagnose_many(todo, executor=executor, tell=killing(lambda: children(executor), said), **QUICK)
    assert same(found, alone)
    assert any("takes its place" in line for line in said)
    assert sum("/4  " in line for line in said) == 4


def test_one_diagnosis_is_heard_from_elsewhere(pool: Executor, tmp_path: Path) -> None:
    (case, _), here, there = cases(tmp_path, 1), list[str](), list[str]()
    one = vpm.diagnose(case.model, case.experiments, case.validate, tell=here.append, workers=1, **QUICK)
    steps: list[object] = []
    other = vpm.diagnose(
        *(case.model, case.experiments, case.validate),
        tell=there.append,
        progress=lambda *step: steps.append(step),
        workers=1,
        executor=pool,
        **QUICK,
    )
    assert same([one], [other])
    assert here == there
    assert steps


@pytest.mark.nightly
def test_loky_makes_a_new_pool_where_one_broke(tmp_path: Path) -> None:
    loky = pytest.importorskip("loky", reason="loky is not installed")
    todo, said = cases(tmp_path, 3), list[str]()
    make = partial(loky.get_reusable_executor, max_workers=2)
    found = diagnose_many(todo, executor=make, tell=killing(lambda: children(make()), said), **QUICK)
    assert same(found, diagnose_many(todo, **QUICK))


def by_dask(count: int, folder: Path) -> None:
    """So many diagnoses by two processes of Dask, one of which is killed."""
    distributed = pytest.importorskip("distributed", reason="dask.distributed is not installed")
    todo, said = cases(folder, count - 1), list[str]()
    with (
        distributed.LocalCluster(2, threads_per_worker=1, processes=True, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        before = set(client.run(os.getpid).values())
        tell = killing(lambda: sorted(before), said)
        found = diagnose_many(todo, executor=client.get_executor(), tell=tell, **QUICK)
    assert len(found) == count
    assert same(found, diagnose_many(todo, **QUICK))


@pytest.mark.nightly
def test_dask_does_without_a_worker(tmp_path: Path) -> None:
    by_dask(4, tmp_path)


@pytest.mark.nightly
def test_dask_does_two_hundred_without_a_worker(tmp_path: Path) -> None:
    by_dask(200, tmp_path)


def test_batches_and_fits_are_the_same_elsewhere(pool: Executor) -> None:
    model, log = arm(), record(Arm(), 2.0, 1)
    trials = [vpm.Trial(log, {"elbow.friction.viscous": 0.1 * k}) for k in range(1, 20)]
    trials.append(vpm.Trial(log, {"no.such": 1.0}))
    done: list[tuple[int, int]] = []
    found = vpm.simulate_batch(model, trials, executor=pool, progress=lambda *n: done.append(n))
    here = vpm.simulate_batch(model, trials)
    assert found[:-1] == here[:-1]
    assert str(found[-1]) == str(here[-1])
    assert done[-1] == (20, 20)
    assert len(done) > 1
    free = ["elbow.friction.viscous", "shoulder.friction.viscous"]
    for mode in ("free_run", "inverse_dynamics"):
        how: dict[str, Any] = {"mode": mode, "fitting": vpm.Fitting(starts=3, loss="huber")}
        assert vpm.identify(model, log, free, executor=pool, **how) == vpm.identify(model, log, free, **how)


def test_reduced_models_are_fitted_the_same_elsewhere(pool: Executor) -> None:
    full = nominal().with_effect("coulomb_friction", at="axis", coulomb=5.0).with_effect("bias_force", at="axis")
    (log,) = simulate_axis(Truth(coulomb=4.0), 1, 1.0, 1)
    judge = Judge(full, [log], [log], 500.0, "restarts")
    trials = Trials(full, judge, lambda _: True, lambda _: None, 0.01, pool)
    trials.ahead([(change,) for changes in reductions(full).values() for change in changes])
    assert len(trials._fits) > 1
    for begun, fitted in trials._fits.items():
        assert fitted == judge.fitted(begun)
        assert fitted != begun
    taken: list[str] = []
    ladder = vpm.simplify(full, log, rate=500.0, tolerance=0.05, executor=pool, tell=taken.append)
    assert ladder.chosen in ladder.rungs


def test_executorlib_takes_batches() -> None:
    executorlib = pytest.importorskip("executorlib", reason="executorlib is not installed")
    model, log = arm(), record(Arm(), 1.0, 1)
    with executorlib.SingleNodeExecutor(max_workers=1, block_allocation=True) as executor:
        assert vpm.simulate_batch(model, [log], executor=executor) == vpm.simulate_batch(model, [log])


def test_a_task_that_always_dies_is_told_and_the_rest_is_kept(tmp_path: Path) -> None:
    said: list[str] = []
    jobs: list[Callable[[], object]] = [partial(double, n) for n in range(6)]
    jobs[2] = die
    found, interrupted = outcomes(jobs, partial(processes, 2), said.append)
    assert not interrupted
    ends = [done for done in found if done is not None]
    assert [done.value for done in ends] == [0, 2, None, 6, 8, 10]
    assert isinstance(ends[2].error, ExecutorError)
    assert "task 2 died with its worker 3 times, the last time alone" in str(ends[2].error)
    assert any("task 2 died" in line and "2 of 3" in line for line in said)
    # Alone, so that no other takes its tries.
    (once,), _ = outcomes([partial(die, tmp_path / "once")], partial(processes, 1), said.append)
    assert once is not None
    assert once.value == "survived"


class Late(ThreadPoolExecutor):
    """An executor that gives the first task up."""

    def __init__(self) -> None:
        super().__init__(1)
        self.given = 0

    def submit(self, *args: Any, **kwargs: Any) -> Future[Any]:
        self.given += 1
        if self.given > 1:
            return super().submit(*args, **kwargs)
        failed: Future[Any] = Future()
        failed.set_exception(TimeoutError("no answer in time"))
        return failed


def test_a_task_that_ran_out_of_time_is_tried_again() -> None:
    said: list[str] = []
    with Late() as executor:
        (done,), _ = outcomes([partial(double, 4)], executor, said.append)
    assert done is not None
    assert done.value == 8
    assert "TimeoutError: no answer in time" in said[0]


def test_an_error_of_the_task_itself_is_no_death(pool: Executor, tmp_path: Path) -> None:
    (done,), _ = outcomes([partial(late, tmp_path / "here")], pool)
    assert done is not None
    assert isinstance(done.error, TimeoutError)
    assert any("On the worker" in note for note in done.error.__notes__)


def test_ctrl_c_keeps_what_is_known(pool: Executor, tmp_path: Path) -> None:
    todo = cases(tmp_path, 2)

    def press(_: str) -> None:
        raise KeyboardInterrupt

    for executor in (None, ThreadPoolExecutor(1), pool):
        with pytest.raises(BatchInterruptedError) as stopped:
            diagnose_many(todo, executor=executor, tell=press, **QUICK)
        known = [answer for answer in stopped.value.outcomes if answer is not None]
        assert len(stopped.value.outcomes) == 3
        assert known
        assert all(isinstance(answer, vpm.Diagnosis | vpm.VpmError) for answer in known)
    found, interrupted = outcomes(
        [partial(double, 1), *[partial(slow, n, 0.2) for n in range(20)]], pool, heard=interrupt
    )
    assert interrupted
    assert found[-1] is None


def interrupt(_: object) -> None:
    raise KeyboardInterrupt


def test_what_no_executor_can_do_is_one_sentence(pool: Executor, monkeypatch: pytest.MonkeyPatch) -> None:
    model, log = arm(), record(Arm(), 1.0, 1)
    shut = ThreadPoolExecutor(1)
    shut.shutdown()
    with pytest.raises(ExecutorError, match=r"the ThreadPoolExecutor takes no task .*; give one that is not shut down"):
        vpm.simulate_batch(model, [log], executor=shut)
    with pytest.raises(ExecutorError, match="cannot be sent to another process, because a part of it"):
        outcomes([lambda: 1], pool)
    monkeypatch.setattr(tasks, "vpm_version", lambda: "0.0.1")
    with pytest.raises(ExecutorError, match=r"\(process \d+\) has vpm .* and the program .* has vpm 0\.0\.1; install"):
        vpm.simulate_batch(model, [log], executor=pool)


def test_a_file_that_a_worker_does_not_see_is_named(tmp_path: Path) -> None:
    path = record(Arm(), 1.0, 1).to_csv(tmp_path / "log.csv")
    log = vpm.Experiment.load(path, name="the log")
    content = sending.packed(partial(vpm.simulate, arm(), log))
    assert len(content) < 6000 < len(sending.packed(partial(vpm.simulate, arm(), log.renamed("another"))))
    given = sending.vpm_version(), (), content, 0
    ending, answer = sending.run_packed(*given)
    assert ending == "value"
    assert sending.unpacked(answer) == vpm.simulate(arm(), log)  # type: ignore[arg-type]
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("0.0,", "0.00000001,", 1), encoding="utf-8")
    changed = sending.unpacked(sending.run_packed(*given)[1])  # type: ignore[arg-type]
    assert "reads other numbers" in str(changed)
    path.unlink()
    gone = sending.unpacked(sending.run_packed(*given)[1])  # type: ignore[arg-type]
    assert isinstance(gone, ExecutorError)
    assert gone.path == str(path)
    assert f"process {os.getpid()}" in str(gone)
    assert "sees no file" in str(gone)
    ending, sentence = sending.run_packed(given[0], [str(tmp_path / "none")], content, 0)
    assert ending == "refused"
    assert "sees no folder" in str(sentence)


def test_a_file_is_read_by_the_table_that_it_was_read_with(tmp_path: Path) -> None:
    model = vpm.Model.load(demo.MODEL)
    log = vpm.Experiment.load(demo.VALIDATION, model=model, resample=250.0)
    table = tmp_path / "table.toml"
    table.write_text(
        'time = { column = "time [s]", unit = "s" }\n"axis.position" = { column = "x [mm]", unit = "mm" }\n',
        encoding="utf-8",
    )
    (tmp_path / "log.csv").write_text("time [s],x [mm]\n" + "".join(f"{n / 100},{n}\n" for n in range(99)))
    other = vpm.Experiment.load(tmp_path / "log.csv", table)
    for record_of, size in ((log, 30_000), (other, 4000)):
        content = sending.packed(partial(vpm.Experiment.renamed, record_of, "again"))
        ending, answer = sending.run_packed(sending.vpm_version(), (), content, 0)
        assert ending == "value"
        assert sending.unpacked(answer) == record_of.renamed("again")  # type: ignore[arg-type]
        assert len(content) < size
        again = pickle.loads(pickle.dumps(record_of))
        assert again == record_of
        assert not again.data.flags.writeable


def test_effects_of_users_go_with_the_task() -> None:
    from vpm.catalogue import register, unregister

    register("soft_spring", law="k * q", sizes={"k": "{E}/{C}"}, sentence="{at} is pulled back by {k}.")
    try:
        content = sending.packed(arm().with_effect("soft_spring", at="elbow", k=1.0).to_dict)
    finally:
        unregister("soft_spring")
    try:
        assert sending.run_packed(sending.vpm_version(), (), content, 0)[0] == "value"
    finally:
        unregister("soft_spring")


def test_linear_algebra_stays_in_one_thread_while_blocks_overlap() -> None:
    def threads() -> list[int]:
        return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]

    before = threads()
    with ThreadPoolExecutor(1) as other:
        ONE_THREAD.__enter__()
        other.submit(ONE_THREAD.__enter__).result()
        ONE_THREAD.__exit__(None, None, None)
        assert all(count == 1 for count in threads())
        other.submit(ONE_THREAD.__exit__, None, None, None).result()
    assert threads() == before
