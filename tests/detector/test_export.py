"""`gap8/model/` is what the shipped model exports to, builds without warnings and answers rightly."""

import shutil
import subprocess
from pathlib import Path

import pytest
from small_model import random_model

from airtouch.detector import export, model_file
from airtouch.errors import AirTouchError

ROOT = Path(__file__).parents[2]
MODEL, KERNELS = ROOT / "gap8" / "model", ROOT / "gap8" / "kernels"
MAIN = """
#include <string.h>
#include "airtouch_golden.h"
#include "airtouch_model.h"
static _Alignas(4) int8_t arena[AIRTOUCH_MODEL_ARENA_BYTES];
int main(void) {
  if (networkInt8Check(&airtouchNetwork) != -1 ||
      networkInt8ArenaBytes(&airtouchNetwork) != AIRTOUCH_MODEL_ARENA_BYTES) return 2;
  for (int i = 0; i < AIRTOUCH_GOLDEN_COUNT; i++) {
    const int8_t *in = airtouchGoldenInputs + i * AIRTOUCH_GOLDEN_INPUTS;
    const int8_t *out = networkInt8Run(&airtouchNetwork, in, arena);
    if (memcmp(out, airtouchGoldenOutputs + i * AIRTOUCH_GOLDEN_OUTPUTS, AIRTOUCH_GOLDEN_OUTPUTS)) return 1;
  }
  return 0;
}
"""


def test_the_generated_sources_are_those_of_the_shipped_model() -> None:
    export.check(model_file.load(), MODEL)


def test_the_generated_sources_build_and_give_the_golden_answers(tmp_path: Path) -> None:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    (tmp_path / "main.c").write_text(MAIN)
    flags = ["-std=c11", "-Os", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion",
             "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    subprocess.run([compiler, *flags, f"-I{KERNELS}", f"-I{MODEL}", str(tmp_path / "main.c"),
                    *map(str, sorted(KERNELS.glob("*.c"))), *map(str, sorted(MODEL.glob("*.c"))), "-lm",
                    "-o", str(tmp_path / "golden")], check=True)
    assert subprocess.run([str(tmp_path / "golden")]).returncode == 0


@pytest.mark.parametrize("sparsity", [0.0, 0.9])
def test_an_export_is_checked(tmp_path: Path, sparsity: float) -> None:
    model, other = random_model(1, sparsity), random_model(2, sparsity)
    written = export.export(model, tmp_path / "model")
    assert len(written) == 4
    export.check(model, tmp_path / "model")
    export.export(model, tmp_path / "model")  # nothing to change, nothing to refuse
    with pytest.raises(AirTouchError, match="--force"):
        export.export(other, tmp_path / "model")
    with pytest.raises(AirTouchError, match="stale or foreign"):
        export.check(other, tmp_path / "model")
    source = tmp_path / "model" / "airtouch_model.c"
    source.write_text(source.read_text().replace("= 3,", "= 4,", 1))
    with pytest.raises(AirTouchError, match="edited"):
        export.check(model, tmp_path / "model")
    source.write_text("int x;\n")
    with pytest.raises(AirTouchError, match="foreign"):
        export.check(model, tmp_path / "model")
    source.unlink()
    with pytest.raises(AirTouchError, match="cannot be read"):
        export.check(model, tmp_path / "model")
    export.export(other, tmp_path / "model", force=True)
    export.check(other, tmp_path / "model")
