"""Dense linear algebra of kernels against NumPy's."""

from __future__ import annotations

import numpy as np
import pytest

from kin.kernels import dense

RNG = np.random.default_rng(57)


def positive(n):
    A = RNG.normal(size=(n, n))
    return A @ A.T + 0.1 * np.eye(n)


@pytest.mark.parametrize("n", [1, 3, 6, 7])
def test_a_positive_system_is_solved_over_its_free_indices(n):
    H, L, x = positive(n), np.full((n, n), np.nan), RNG.normal(size=n)
    free = np.arange(n) != 1
    m, right = dense.packed(np.tril(H) + np.triu(np.full((n, n), np.nan), 1), free, L), x.copy()
    assert m == free.sum()
    assert dense.solve_positive(L, m, 0.5, 0.0, x)
    expected = np.linalg.solve(H[np.ix_(free, free)] + 0.5 * np.eye(m), right[:m])
    assert np.abs(x[:m] - expected).max() < 1e-12


def test_the_gram_matrix_is_of_the_rows_that_count():
    J, A = RNG.normal(size=(6, 7)), np.empty((5, 5))
    dense.gram(J, 5, 0.1, A)
    assert np.abs(A - J[:5] @ J[:5].T - 0.1 * np.eye(5)).max() < 1e-14


def test_a_matrix_that_is_not_positive_definite_is_refused():
    H = np.diag([1.0, -1e-3, 2.0])
    assert not dense.cholesky(H.copy(), 3, 0.0, 0.0)
    assert dense.cholesky(H.copy(), 3, 1e-2, 0.0)
    assert not dense.cholesky(np.diag([1.0, np.nan]), 2, 1.0, 0.0)


def test_a_pivot_may_be_too_small_a_share_of_its_entry():
    nearly = np.array([[1.0, 1.0], [1.0, 1.0 + 1e-9]])
    assert dense.cholesky(nearly.copy(), 2, 0.0, 0.0)
    assert not dense.cholesky(nearly.copy(), 2, 0.0, 1e-6)


def test_the_null_vector_and_the_shortest_solution_are_those_of_the_pseudoinverse():
    A, n, x = np.empty((7, 8)), np.empty(7), np.empty(7)
    for _ in range(20):
        J, e = RNG.normal(size=(6, 7)), RNG.normal(size=6)
        assert dense.shortest_and_null(J, e, A, n, x)
        assert np.abs(J @ n).max() < 1e-12
        assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-14)
        assert np.linalg.det(np.vstack([J, n])) > 0.0
        assert np.abs(x - np.linalg.pinv(J) @ e).max() < 1e-9
    J[5] = J[4]
    assert not dense.shortest_and_null(J, e, A, n, x)


@pytest.mark.parametrize("shape", [(6, 6), (7, 6), (6, 4), (6, 1)])
def test_singular_values_are_numpys(shape):
    A = RNG.normal(size=shape)
    A[:, -1] *= 1e-5
    k, exact = shape[1], np.linalg.svd(A, compute_uv=False)
    V, w, turned = np.empty((k, k)), np.empty(k), A.copy()
    dense.singular_values(turned, V, w)
    assert np.sqrt(np.sort(w)[::-1]) == pytest.approx(exact, rel=1e-12)
    assert np.abs(A @ V - turned).max() < 1e-14
    assert dense.volume(A.copy()) == pytest.approx(exact.prod(), rel=1e-12)
    pivot = dense.least_pivot(A.copy())
    assert exact[-1] <= pivot * (1.0 + 1e-12)
    assert pivot < 80.0 * exact[-1]
