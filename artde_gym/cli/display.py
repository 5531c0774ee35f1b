"""Progress display on the console."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from artde_gym.evaluation.environments import physics_of
from artde_gym.evaluation.provenance import versions

if TYPE_CHECKING:
    from artde_gym.evaluation.tasks import Task, Update


def terminal() -> Console:
    """Return a console without markup, so that brackets in a path or a label are printed."""
    return Console(markup=False, emoji=False)


def passing_bar(console: Console) -> Progress:
    """Return a bar of one task's description and time, which vanishes, and shows nothing but in a terminal."""
    place = console if console.is_interactive else Console(quiet=True)
    return Progress(words("description"), TimeElapsedColumn(), console=place, transient=True)


def words(field: str) -> TextColumn:
    """Return a progress-bar column that shows a field of its task without markup."""
    return TextColumn(f"{{task.{field}}}", markup=False)


class Display:
    """Progress of an evaluation: a bar of finished episodes, and the simulated time of running ones."""

    def __init__(self, console: Console) -> None:
        self._running: dict[tuple[str, str, str], float] = {}
        self._what = "episodes"
        self._progress = Progress(
            words("fields[what]"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            words("description"),
            console=console,
        )
        self._bar = self._progress.add_task("", total=None, what="episodes")

    def __enter__(self) -> Display:
        return self

    def __exit__(self, *_: object) -> None:
        if self._progress.live.is_started:
            self._progress.update(self._bar, description="")
            self._progress.stop()

    def __call__(self, update: Update, what: str = "episodes") -> None:
        if not self._progress.live.is_started:
            self._progress.console.print(f"Engine: {engine_of(update.task)}")
        self._progress.start()  # with the first update, so that an earlier error leaves no empty bar
        if what != self._what:
            self._what = what
            self._progress.reset(self._bar)  # a full bar has stopped its clock
        first, last = min(update.task.episodes), max(update.task.episodes)
        numbers = f"#{first}" if first == last else f"#{first}..{last}"
        key = (update.task.cell.name, update.task.controller, numbers)
        self._running[key] = update.time_s
        if update.ended:
            del self._running[key]
        text = ", ".join(
            f"{name} {controller} {numbers}: {time:.0f} s"
            for (name, controller, numbers), time in self._running.items()
        )
        self._progress.update(self._bar, completed=update.finished, total=update.total, description=text, what=what)


def engine_of(task: Task) -> str:
    """Return the physics engine of a task and its version."""
    written = physics_of(task.cell.kwargs)
    return " ".join([written, *versions([written.lower()]).values()])
