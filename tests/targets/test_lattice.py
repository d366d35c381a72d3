import numpy as np
import pytest

from handeye_cli.targets import lattice

QUARTER = np.array([[0.0, -1.0], [1.0, 0.0]])


def brute_force(points, looks, *, mirrored=False):
    """Quarter turns about the middle that bring equal looks onto each other, by distances."""
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    flip = np.diag([-1.0, 1.0]) if mirrored else np.eye(2)
    found = []
    for quarter in range(4):
        moved = (points - middle) @ (np.linalg.matrix_power(QUARTER, quarter) @ flip).T + middle
        distance = np.linalg.norm(moved[:, None] - points[None], axis=-1)
        nearest = distance.argmin(axis=1)
        if distance.min(axis=1).max() < 1e-9 and np.array_equal(looks, looks[nearest]):
            found.append(nearest)
    return found


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize(("columns", "rows"), [(3, 3), (4, 4), (5, 3), (2, 7)])
def test_symmetries_of_a_grid_are_those_found_by_brute_force(columns, rows, mirrored):
    grid = lattice.grid(columns, rows)
    expected = brute_force(grid.astype(float), np.zeros(len(grid)), mirrored=mirrored)
    found = lattice.symmetries(grid, mirrored=mirrored)
    assert len(found) == (4 if columns == rows else 2)
    np.testing.assert_array_equal(found, expected)


def test_marks_take_symmetries_away():
    grid = lattice.grid(4, 4)
    looks = np.zeros(16, dtype=np.int64)
    looks[[0, 15]] = 1
    found = lattice.symmetries(grid, np.column_stack([grid, looks]))
    np.testing.assert_array_equal(found, brute_force(grid.astype(float), looks))
    assert len(found) == 2


def test_points_of_a_grid_go_row_by_row_to_the_right_and_down():
    points = lattice.flat_points(lattice.grid(3, 2), 0.5)
    assert points.tolist() == [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]]


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("turn", range(4))
def test_right_handed_orders_never_show_a_grid_from_behind(turn, mirrored):
    rng = np.random.default_rng(turn)
    grid = lattice.grid(5, 5)
    H = np.array([[9.0, 2.0, 80.0], [-1.0, 11.0, 60.0], [1e-3, -2e-3, 1.0]])
    seen = np.column_stack([grid, np.ones(25)]) @ H.T
    pixels = seen[:, :2] / seen[:, 2:] + rng.normal(0, 0.1, (25, 2))
    shuffled = pixels[brute_force(grid.astype(float), np.zeros(25), mirrored=mirrored)[turn]]

    orders = lattice.right_handed(grid, shuffled)

    assert len(orders) == 4
    for order in orders:
        corner, right, down = (shuffled[order[k]] for k in (0, 4, 20))
        area = np.linalg.det(np.stack([right - corner, down - corner]))
        assert area > 0
    first = lattice.first_in_image(shuffled, orders)
    np.testing.assert_array_equal(shuffled[first], pixels)


def test_a_mirrored_view_of_a_layout_without_mirror_symmetry_has_no_order():
    asymmetric = np.array([[0, 0], [2, 0], [4, 0], [0, 2]])
    mirrored = asymmetric * [-10.0, 10.0]
    assert lattice.right_handed(asymmetric, mirrored) == ()


def test_what_is_kept_for_the_next_image_cannot_be_changed():
    grid = lattice.grid(4, 3)
    assert lattice.grid(4, 3) is grid
    with pytest.raises(ValueError, match="read-only"):
        grid[0] = 1
    orders = lattice.right_handed(grid, grid.astype(float))
    with pytest.raises(ValueError, match="read-only"):
        orders[0][0] = 1
    np.testing.assert_array_equal(lattice.grid(4, 3)[5], [2, 2])


@pytest.mark.parametrize("mirrored", [False, True])
def test_orders_of_a_lattice_seen_from_its_front_are_its_symmetries(mirrored):
    rng = np.random.default_rng(3)
    grid = lattice.grid(4, 4)
    flip = np.diag([-1.0, 1.0]) if mirrored else np.eye(2)
    pixels = grid @ flip @ rng.normal([[5.0, 1.0], [-1.0, 5.0]], 0.1) + [300.0, 200.0]
    expected = lattice.symmetries(grid, mirrored=mirrored)
    np.testing.assert_array_equal(lattice.right_handed(grid, pixels), expected)


def test_flat_points_lie_on_the_plane_in_metres():
    points = lattice.flat_points(lattice.grid(2, 2), 0.5)
    np.testing.assert_array_equal(points, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
