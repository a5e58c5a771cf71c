"""The table of measured modes."""

from __future__ import annotations

import numpy as np
import pytest
from rich.console import Console

from tyrecal.measured.labels import Judged
from tyrecal.measured.modal import LabelledMode, ModalTest
from tyrecal.measured.sensors import MeasuredMode, Sensors
from tyrecal.report.measured import measured_table
from tyrecal.simulate.modes.label import Label


@pytest.mark.parametrize("name", ["[run].uff", "[bold].uff", "run [2].uff"])
def test_names_are_no_markup(name: str) -> None:
    """File names and labels in square brackets stand there as they are."""
    sensors = Sensors(np.zeros((1, 3)), np.eye(3)[:1])
    label = Label(2, 1)
    judged = Judged(label, {label: 1.0}, f"like {label}")
    mode = MeasuredMode(66.1, np.ones(1), 0.02, 0.1)
    labelled = LabelledMode(mode, sensors, np.ones(1), 1.0, judged, "", "1")
    console = Console(width=100)
    with console.capture() as text:
        console.print(measured_table([ModalTest(name, (labelled,))]))
    assert name in text.get() and "[2,1] member 1" in text.get() and "like [2,1]" in text.get()
