"""Networks of one layer, in ONNX files that the tests write themselves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

TAKES = "onnxruntime and onnx are missing: pip install 'okiagari[onnx]'"


def write_network(path: Path, weight: Any, bias: Any = 0.0, *, batch: int | str | None = 1) -> Path:
    """`y = weight x + bias` with weight (a, n); `batch` None for vectors without that dimension."""
    import onnx
    from onnx import TensorProto, helper, numpy_helper

    weight = np.atleast_2d(np.asarray(weight, dtype=np.float32))
    count, size = weight.shape
    bias = np.broadcast_to(np.asarray(bias, dtype=np.float32), (count,)).copy()
    shape = [] if batch is None else [batch]
    graph = helper.make_graph(
        [helper.make_node("MatMul", ["obs", "w"], ["wx"]), helper.make_node("Add", ["wx", "b"], ["action"])],
        "tiny",
        [helper.make_tensor_value_info("obs", TensorProto.FLOAT, [*shape, size])],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, [*shape, count])],
        [numpy_helper.from_array(weight.T.copy(), "w"), numpy_helper.from_array(bias, "b")],
    )
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8), path)
    return path


def write_recurrent(path: Path) -> Path:
    """A network that hands its state on from call to call: y = obs + state."""
    import onnx
    from onnx import TensorProto, helper

    one = [1, 3]
    graph = helper.make_graph(
        [helper.make_node("Add", ["obs", "state"], ["action"]), helper.make_node("Identity", ["action"], ["next"])],
        "recurrent",
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, one) for name in ("obs", "state")],
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, one) for name in ("action", "next")],
    )
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8), path)
    return path
