"""The labels of frequencies that came without, as files and tables have them: labels.json,
labels.csv, and a part of fit.json."""

from __future__ import annotations

from pydantic import Field

from ..simulate.modes.label import Label
from .correlation import ShapeCorrelation
from .result import Column, CsvRow, PositiveNumber, Result, ResultPart, Table, csv_text, state_words

FOREIGN_WORDS = "no mode of the tyre"
MAX_RIVALS = 4  # labels, and labelings, that are listed beside the likeliest
MIN_RIVAL_PROBABILITY = 0.01  # of those
SURE_LABEL = 0.9  # probability below which a label is in doubt


class LabelProbability(ResultPart):
    """A label, or none for what is no mode, and how probable it is."""

    c: int | None = None
    m: int | None = None
    kind: str | None = None
    probability: float  # probability of this label; without c and m, that it is no mode

    @property
    def label(self) -> Label | None:
        """[c, m]"""
        return None if self.c is None or self.m is None else Label(self.c, self.m, self.kind)

    @property
    def display(self) -> str:
        """Label in words."""
        return self.label.display if self.label else FOREIGN_WORDS


class LabelledFrequency(LabelProbability):
    """A measured frequency without a label: the one of the likeliest labeling, with the probability
    that it is this frequency's; the ``rivals``' too."""

    frequency_Hz: PositiveNumber
    sigma_Hz: PositiveNumber | None  # standard deviation; null: not stated
    pressure_kPa: float
    rim: str
    expected_Hz: float | None = None  # frequency of the mode at the variables' prior mean
    rivals: list[LabelProbability]  # other labels

    @property
    def state(self) -> str:
        """State in words."""
        return state_words(self.pressure_kPa, 0.0, self.rim)


class Labeling(ResultPart):
    """All labels together, in the order of the frequencies, and their probability."""

    labels: list[str]  # labels in the order of the frequencies
    probability: float  # probability of all labels together


class Labels(ResultPart):
    """Labels of all frequencies that came without one."""

    frequencies: list[LabelledFrequency]  # measured frequencies without a label
    labelings: list[Labeling]  # all labels together, the likeliest first
    model_off_percent: float  # likely rms error of the model's frequencies
    expansions: int  # expansions of the model that were needed
    settled: bool  # whether the labels are those of the design that they lead to

    @property
    def doubtful(self) -> list[LabelledFrequency]:
        """Frequencies whose label is less than `SURE_LABEL` probable."""
        return [each for each in self.frequencies if each.probability < SURE_LABEL]

    def table(self) -> Table:
        """A line a frequency."""
        heads = [Column("measured in", ""), Column("Hz", ".1f"), Column("mode", "")]
        heads += [Column("model, Hz", ".1f"), Column("probability, %"), Column("else", "")]
        rows = [
            [
                each.state,
                f"{each.frequency_Hz:.1f}",
                each.display,
                None if each.expected_Hz is None else f"{each.expected_Hz:.1f}",
                f"{100 * each.probability:.1f}",
                ", ".join(f"{r.display} {100 * r.probability:.1f} %" for r in each.rivals),
            ]
            for each in self.frequencies
        ]
        return Table(heads, rows, title="Labels of frequencies without a label", csv="labels")

    def csv_rows(self) -> list[CsvRow]:
        """A row a frequency, with each rival in words."""
        return [
            {
                **each.model_dump(),
                "rivals": [f"{rival.display} {rival.probability:.4f}" for rival in each.rivals],
            }
            for each in self.frequencies
        ]

    def sentences(self) -> list[str]:
        """Sentences on the probability of the labels."""
        best = self.labelings[0]
        sentences = [f"all these labels together are {100 * best.probability:.1f} % probable"]
        if len(self.labelings) > 1:
            other = self.labelings[1]
            sentences.append(f"next are {', '.join(other.labels)}, {100 * other.probability:.1f} %")
        return sentences

    def doubts(self) -> list[str]:
        """Doubts about the labels that must not be overlooked."""
        doubts = []
        if self.doubtful:
            where = ", ".join(f"{each.frequency_Hz:g} Hz" for each in self.doubtful)
            doubts.append(f"labels less than {100 * SURE_LABEL:.0f} % probable: {where}")
        if not self.settled:
            doubts.append("no labeling is consistent with its own fit: give labels that you know")
        return doubts


class LabelsResult(Result):
    """labels.json"""

    study, stem, command, heading = "labels", "labels", "measured label", "Labels"
    is_seldom = True

    figures = "tyrecal.report.sensitivities:mac_figures"

    labels: Labels  # labels of frequencies that came without one
    shapes: list[ShapeCorrelation] = Field(default=[])  # measured shapes with modes of the case

    def csv(self) -> str:
        keys = ["frequency_Hz", "sigma_Hz", "pressure_kPa", "rim", "c", "m", "kind", "probability"]
        return csv_text([*keys, "expected_Hz", "rivals"], self.labels.csv_rows())

    def tables(self) -> list[Table]:
        return [self.labels.table(), *(each.table() for each in self.shapes)]

    def numbers(self) -> list[Table]:
        return [each.sensors_table() for each in self.shapes]

    def sentences(self) -> list[str]:
        return self.labels.sentences() + [s for each in self.shapes for s in each.sentences()]

    def doubts(self) -> list[str]:
        return self.labels.doubts()
