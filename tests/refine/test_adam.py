"""Adam: the steps of torch's own, also after a stop."""

import pytest

torch = pytest.importorskip("torch", reason="needs the extra [refine]")

from brushgs.refine.variables import Adam  # noqa: E402

RATES = {"means": 0.02, "colors": 0.3}


def start():
    generator = torch.Generator().manual_seed(0)
    return {name: torch.randn(5, 3, generator=generator).requires_grad_() for name in RATES}


def loss_of(moving):
    return (moving["means"].square() * moving["colors"]).sum()


def run(moving, optimizer, factors):
    for factor in factors:
        loss_of(moving).backward()
        optimizer.step(factor)


def test_steps_are_those_of_torch():
    moving, others, factors = start(), start(), (1.0, 0.7, 0.2, 0.05)
    run(moving, Adam(moving, RATES), factors)
    groups = [{"params": [others[name]], "lr": rate} for name, rate in RATES.items()]
    expected = torch.optim.Adam(groups, betas=(0.9, 0.99), eps=1e-15)
    for factor in factors:
        for group, rate in zip(expected.param_groups, RATES.values(), strict=True):
            group["lr"] = factor * rate
        expected.zero_grad()
        loss_of(others).backward()
        expected.step()
    for name in RATES:
        assert torch.equal(moving[name], others[name])
        assert not torch.equal(moving[name], start()[name])


def test_a_state_of_other_parameters_is_refused():
    moving = start()
    wider = {name: torch.zeros(6, 3, requires_grad=True) for name in RATES}
    with pytest.raises(ValueError, match="the means of means have another shape"):
        Adam(moving, RATES).restore(Adam(wider, RATES).state())


def test_what_has_no_gradient_stays():
    moving = start()
    optimizer = Adam(moving, RATES)
    moving["means"].sum().backward()
    optimizer.step(1.0)
    assert torch.equal(moving["colors"], start()["colors"])
    assert moving["means"].grad is None
