import numpy as np
import pytest

from artde_gym.errors import UnknownNameError
from artde_gym.layout import Field, Layout
from artde_gym.robots.ojas.task import ACTION, OBSERVATION

MIXED = Layout(
    (Field("a", 3, "rad", -1.0, 1.0, "angles"), Field("b", 1, "1", 0.0, 2.0, "flag"), Field("c", 2, "N", -5.0, 0.0, ""))
)
every_layout = pytest.mark.parametrize("layout", [MIXED, OBSERVATION, ACTION], ids=["mixed", "observation", "action"])


@every_layout
def test_slices_partition_the_vector_in_order(layout):
    indices = [index for part in layout.slices.values() for index in range(part.start, part.stop)]
    assert indices == list(range(layout.size))
    assert list(layout.slices) == [field.name for field in layout.fields]
    for field in layout.fields:
        part = layout[field.name]
        assert part.stop - part.start == field.size


@every_layout
def test_split_gives_views(layout):
    vectors = np.random.default_rng(15).normal(size=(4, 3, layout.size))
    parts = layout.split(vectors)
    np.testing.assert_array_equal(np.concatenate(list(parts.values()), axis=-1), vectors)
    for name, part in parts.items():
        part[:] = 7.0
        np.testing.assert_array_equal(vectors[..., layout[name]], 7.0)
    np.testing.assert_array_equal(vectors, 7.0)


@every_layout
def test_box_has_the_bounds_of_the_fields(layout):
    box = layout.box()
    assert box.shape == (layout.size,)
    assert box.dtype == np.float64
    assert np.isfinite(box.low).all()
    assert np.isfinite(box.high).all()
    for field in layout.fields:
        assert set(box.low[layout[field.name]]) == {field.low}
        assert set(box.high[layout[field.name]]) == {field.high}


@every_layout
def test_table_lists_every_field_with_its_place(layout):
    header, _, *rows = layout.table().splitlines()
    assert len(rows) == len(layout.fields)
    for row, field in zip(rows, layout.fields, strict=True):
        cells = [cell.strip() for cell in row.strip("|").split("|")]
        assert len(cells) == header.count("|") - 1
        first, last = (
            (int(number) for number in (cells[0].split("..") * 2)[:2]) if ".." in cells[0] else [int(cells[0])] * 2
        )
        assert slice(first, last + 1) == layout[field.name]
        assert cells[1:3] == [f"`{field.name}`", field.unit]
        assert [float(cell) for cell in cells[3:5]] == pytest.approx([field.low, field.high], rel=1e-5)
        assert cells[5] == field.text


def test_unknown_fields_are_refused():
    with pytest.raises(UnknownNameError, match=r"'torque'.*tau_applied"):
        OBSERVATION["torque"]
