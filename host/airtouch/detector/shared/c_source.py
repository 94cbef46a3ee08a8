"""Networks as C text: the pieces that every export is made of."""

import hashlib

import numpy as np

from airtouch.kernels.network import layer_shape, packed_weights
from airtouch.reference.networks.int8_network import Int8Layer, runs_sparse

#: qualifier of a network's data in C: `const`, unless the file that includes the source defines it otherwise, as
#: gap8/app/src/l1_*.c do
CONST = "AIRTOUCH_MODEL_CONST"
#: what stands below the includes of a network's source
CONST_DEFAULT = f"#ifndef {CONST}\n#define {CONST} const\n#endif\n"


def layer(name: str, int8: Int8Layer) -> tuple[str, str]:
    """The C arrays of one layer, whose names begin with `name`, and the initialiser of its layerInt8_t."""
    _, *shape = layer_shape(int8)
    kind = f"{'SPARSE_' if runs_sparse(int8) else ''}{int8.kind.name.upper()}"
    sizes = [", ".join(map(str, shape[start:stop])) for start, stop in ((0, 3), (3, 6), (6, 8), (8, 11))]
    head = (f"{{.kind = LAYER_{kind}, LAYER_IN({sizes[0]}), LAYER_OUT({sizes[1]}), "
            f"LAYER_KERNEL({sizes[2]}), LAYER_RANGE({sizes[3]})")
    if not int8.weighted:
        return "", head + "}"
    weights, counts, skips = packed_weights(int8)
    bias, multiplier, shift = int8.c_constants()
    arrays = [("Weights", "int8_t", weights), ("Bias", "int32_t", bias),
              ("Multiplier", "int32_t", multiplier), ("Shift", "int8_t", shift)]
    if counts.size:
        arrays += [("BlockCounts", "uint16_t", counts), ("BlockSkips", "uint8_t", skips)]
    text = "".join(array(kind, name + what, np.ravel(values)) for what, kind, values in arrays)
    return text, f"{head},\n     LAYER_{'SPARSE' if counts.size else 'DENSE'}_ARRAYS({name})}}"


def array(kind: str, name: str, values: np.ndarray, qualifiers: str = f"static {CONST}") -> str:
    """The C definition of an array of this element type (`kind`), aligned to four bytes."""
    head = f"{qualifiers} {kind} {name}[{max(values.size, 1)}]"
    lines, line = [], "   "
    for value in values.tolist() or [0]:  # C has no empty array
        if len(line) + len(f" {value},") > 108:
            lines.append(line)
            line = "   "
        line += f" {value},"
    return f"_Alignas(4) {head} = {{\n" + "\n".join([*lines, line]) + "\n};\n\n"


def golden_header(what: str, prefix: str, names: tuple[str, str], inputs: np.ndarray, outputs: np.ndarray) -> str:
    """A header that declares golden inputs (n, ...) and outputs (m, ...), with their hash.

    what: the comment on its first line. prefix: of its constants. names: of the two arrays.
    """
    digest = hashlib.sha256(inputs.tobytes() + outputs.tobytes()).hexdigest()
    return f"""// {what}
#pragma once

#include <stdint.h>

#define {prefix}_SHA256 "{digest}"  // of inputs, then outputs
#define {prefix}_COUNT {len(inputs)}
#define {prefix}_INPUTS {inputs.shape[1]}
#define {prefix}_OUTPUTS {outputs.shape[1]}

extern const int8_t {names[0]}[{inputs.size}];
extern const int8_t {names[1]}[{outputs.size}];
"""


def golden_source(header: str, names: tuple[str, str], inputs: np.ndarray, outputs: np.ndarray) -> str:
    """Definitions of what `golden_header` declares; `header` is its file's name."""
    arrays = (array("int8_t", name, values.ravel(), "const")
              for name, values in zip(names, (inputs, outputs), strict=True))
    return (f'#include "{header}"\n\n' + "".join(arrays)).rstrip("\n") + "\n"


def float_literal(value: float) -> str:
    """A C float literal of exactly this float32."""
    return f"{np.float32(value):.9e}f"
