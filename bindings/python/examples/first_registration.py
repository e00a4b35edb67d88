# %% [markdown]
# # A first registration
# Two leaves of a file are registered: the flow that takes the first to the second, its cost, and a point that moves with it.

# %%
import numpy as np
import pulson

leaves = pulson.read("sample_shapes/leaves.tps")
match = pulson.register(leaves[0], leaves[1])
match

# %% [markdown]
# The result is within a few σ of the target. The path of the landmarks is an array of steps, landmarks and axes.

# %%
print(f"rms {match.record['initial_rms']:.4g} before, {match.rms:.4g} after; kernel {match.kernel}")
path = match.shoot()
assert match.matched and match.rms < match.record["initial_rms"] / 20
assert np.array_equal(path.end, match.result)

# %% [markdown]
# Any point moves with the flow, and back.

# %%
centre = leaves[0].points.mean(axis=0, keepdims=True)
there, jacobian = match.warp_points(centre, jacobians=True)
back = match.warp_points(there, inverse=True)
print(f"the centre {centre[0].round(2)} goes to {there[0].round(2)}, area there times {jacobian[0]:.3g}")
assert np.allclose(back, centre)

# %%
try:
    match.plot().figure.savefig
except ImportError:
    print("python3-matplotlib draws it")
