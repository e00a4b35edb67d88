# %% [markdown]
# # From a cohort to its atlas, with an audit before
# Two landmarks of one leaf are exchanged, as happens at the keyboard. The audit names them; the atlas is made of what is right.

# %%
import numpy as np
import pulson

leaves = pulson.read("sample_shapes/leaves.tps", landmarks="1,3,5,8,10,12,15,17")[:8]
points = {shape.name: np.array(shape.points) for shape in leaves}
spoiled = {name: array.copy() for name, array in points.items()}
victim = list(spoiled)[2]
spoiled[victim][[1, 4]] = spoiled[victim][[4, 1]]

# %%
audit = pulson.audit(spoiled)
for finding in audit.record["findings"]:
    print(finding["specimen"], finding["kind"], finding["landmarks"])
assert any(f["specimen"] == victim and f["kind"] == "exchanged" for f in audit.record["findings"])
assert len(pulson.audit(points)) < len(audit) or len(pulson.audit(points)) == 0

# %%
atlas = pulson.atlas(points)
eigenvalues = np.array(atlas.record["modes"]["eigenvalues"])
print(f"template of {len(atlas.template)} landmarks, momenta {atlas.momenta.shape}")
print(f"the first mode holds {100 * eigenvalues[0] / eigenvalues.sum():.0f} % of the variance")
assert atlas.momenta.shape == (8, 8, 2) and (np.diff(eigenvalues) <= 0).all()
