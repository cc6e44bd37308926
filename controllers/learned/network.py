"""A network in an ONNX file: one vector in, one vector out, the same bits each time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from models.errors import InputError, one_line

Array = NDArray[np.float64]

_TYPES = {"tensor(float)": np.float32, "tensor(double)": np.float64}


class Network:
    """A feed-forward network, on one thread of the CPU.

    Attributes:
        inputs: how many numbers it takes; None if its file leaves that open.
    """

    def __init__(self, path: Path, field: str) -> None:
        """Read it.

        Args:
            path: of the ONNX file, which holds its weights itself.
            field: of the scenario, for messages.

        Raises:
            InputError: if onnxruntime is missing, the file is no network, or one of another kind.
        """
        try:
            import onnxruntime as runtime
        except ModuleNotFoundError:
            raise InputError(f"{field}: needs onnxruntime; pip install 'okiagari[onnx]'") from None
        self._where = f"{field}: {path.name!r}"
        options = runtime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.execution_mode = runtime.ExecutionMode.ORT_SEQUENTIAL
        options.use_deterministic_compute = True
        # What fails is raised; the rest would be written between lines of ours.
        options.log_severity_level = 4
        runtime.set_default_logger_severity(4)
        try:
            # The bytes and not the path: what is not in the file is not in its hash either.
            self._session = runtime.InferenceSession(path.read_bytes(), options, providers=["CPUExecutionProvider"])
        except OSError as error:
            raise InputError(f"{self._where} cannot be read: {error.strerror}") from None
        except Exception as error:  # noqa: BLE001  # of a library in C++, which has its own kinds
            raise InputError(f"{self._where} is no network that can be run: {one_line(error)}") from None
        (self._input, self._dtype, self._rank, self.inputs) = self._vector("input", self._session.get_inputs())
        self._output = self._vector("output", self._session.get_outputs())[0]

    def _vector(self, what: str, found: list[Any]) -> tuple[str, Any, int, int | None]:
        """Name, type, dimensions and length of the one input or output."""
        if len(found) != 1:
            names = ", ".join(repr(each.name) for each in found)
            raise InputError(
                f"{self._where} has {len(found)} {what}s, {names}; it must have one: recurrent networks, and others "
                "with several inputs or outputs, cannot be run"
            )
        (each,) = found
        shape = each.shape or []
        *batch, length = shape or [0]
        if each.type not in _TYPES or len(shape) not in (1, 2) or any(isinstance(n, int) and n != 1 for n in batch):
            raise InputError(
                f"{self._where}: its {what} {each.name!r} is a {each.type} of shape {shape}; it must be a vector of "
                "floats, (n) or (1, n)"
            )
        return each.name, _TYPES[each.type], len(shape), length if isinstance(length, int) else None

    def __call__(self, values: Array) -> Array:
        """What it answers (a,) to its input (n,).

        Raises:
            InputError: if it cannot be run with so many numbers.
        """
        given = values.astype(self._dtype).reshape((1, -1) if self._rank == 2 else (-1,))
        try:
            (answer,) = self._session.run([self._output], {self._input: given})
        except Exception as error:  # noqa: BLE001  # see above
            raise InputError(f"{self._where} cannot be run with {len(values)} numbers: {one_line(error)}") from None
        return np.asarray(answer, dtype=np.float64).ravel()
