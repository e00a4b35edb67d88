# %% [markdown]
# # Crossing probabilities against the paper
# Two Gaussian pulsons on a line, the fast one behind: q = (0, 10), p = (p̄₁, 1), noise β on the position of the slow one. Without
# noise the fast one never passes. Figure 3 of Holm and Tyranowski has the probability that it does at t = 100, over β.
# `docs/experiments.md` has 0.838 for p̄₁ = 4 and β = 6.5 by the paper's 50,000 paths; here are fewer.

# %%
import numpy as np
import pulson

MODEL = dict(q=[0, 10], p=[4, 1], kernel="gaussian:alpha=1", time=100, integrator="variational-paper", samples=512)

betas = [0, 4, 6.5]
probabilities, errors = [], []
for beta in betas:
    noise = f"ch-sd:beta={beta},on=2" if beta else None
    crossing = pulson.ensemble(noise=noise, **MODEL).crossing
    probabilities.append(crossing["probability"])
    errors.append(crossing["standard_error"] or 0)
    print(f"beta {beta:4}: {probabilities[-1]:.3f} ± {errors[-1]:.3f}")

# %% [markdown]
# The same numbers as the full run, within four standard errors, and the rise with β of figure 3.

# %%
assert probabilities[0] == 0
assert abs(probabilities[1] - 0.7005) < 4 * errors[1]
assert abs(probabilities[2] - 0.838) < 4 * errors[2]
assert (np.diff(probabilities) > 0).all()
