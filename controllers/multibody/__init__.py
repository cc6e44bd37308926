"""Compiled kernels of a floating tree of bodies, for the layers `dynamics` and `ik` and for the estimators.

Of the tree: `tree`, its kinematics and momentum; `sole_terms`, the Jacobians of the soles and what they are asked for.
Of `dynamics`: `torque_kernel`, the weighted QP. Of `ik`: `motion_kernel`, with its tasks (`motion_tasks`), the share of
the floor's wrench that each sole bears (`sharing`) and limits (`holding`). `elimination` is the algebra of both layers.
"""
