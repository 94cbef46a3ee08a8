"""`gap8/model/` is what the shipped model exports to, builds without warnings and answers rightly."""

import shutil
import subprocess
from pathlib import Path

import pytest

from airtouch.detector import best
from airtouch.detector.paper import model as model_file
from airtouch.detector.paper import rolling
from airtouch.detector.shared import export
from airtouch.errors import AirTouchError
from objects import compiled
from small_model import random_model

ROOT = Path(__file__).parents[3]
MODEL, KERNELS, FIRMWARE = ROOT / "gap8" / "model", ROOT / "gap8" / "kernels", ROOT / "firmware" / "kernels"
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


STREAM_MAIN = """
#include <string.h>
#include "airtouch_stream.h"
#include "airtouch_stream_golden.h"
#include "stream_detector.h"
static _Alignas(4) int8_t arena[AIRTOUCH_STREAM_ARENA_BYTES];
static streamDetector_t detector;
int main(void) {
  if (streamInt8ArenaBytes(&airtouchStream) != AIRTOUCH_STREAM_ARENA_BYTES ||
      !streamDetectorInit(&detector, &airtouchStreamMotion, &airtouchStream, &airtouchStreamQuantisation,
                          &airtouchStreamDecoder, arena)) return 2;
  const int8_t *expected = airtouchStreamGoldenOutputs;
  for (int i = 0; i < AIRTOUCH_STREAM_GOLDEN_COUNT; i++) {
    const int8_t *in = airtouchStreamGoldenInputs + i * AIRTOUCH_STREAM_GOLDEN_INPUTS;
    const int8_t *out = streamInt8Step(&airtouchStream, &detector.state, in);
    if (out && memcmp(out, expected, AIRTOUCH_STREAM_GOLDEN_OUTPUTS)) return 1;
    expected += out ? AIRTOUCH_STREAM_GOLDEN_OUTPUTS : 0;
  }
  return expected == airtouchStreamGoldenOutputs + sizeof airtouchStreamGoldenOutputs ? 0 : 3;
}
"""


def test_the_generated_sources_are_those_of_the_shipped_models() -> None:
    """`check` raises where a file is stale, edited or foreign."""
    export.check(model_file.load(), MODEL)
    export.check(best.load(None), MODEL)
    export.check(rolling.load(None), MODEL)


ROLLING_MAIN = """
#include <string.h>
#include "airtouch_rolling.h"
#include "airtouch_rolling_golden.h"
static _Alignas(4) int8_t arena[AIRTOUCH_ROLLING_ARENA_BYTES];
static rollingInt8_t rolling;
int main(void) {
  if (rollingInt8ArenaBytes(&airtouchRolling, AIRTOUCH_ROLLING_STRIDE) != AIRTOUCH_ROLLING_ARENA_BYTES ||
      !rollingInt8Init(&rolling, &airtouchRolling, AIRTOUCH_ROLLING_STRIDE, arena)) return 2;
  for (int again = 0; again < 2; again++, rollingInt8Reset(&rolling)) {
    const int8_t *expected = airtouchRollingGoldenOutputs;
    const int8_t *end = expected + sizeof airtouchRollingGoldenOutputs;
    for (int i = 0; i < AIRTOUCH_ROLLING_GOLDEN_COUNT && expected < end; i++) {
      const int8_t *in = airtouchRollingGoldenInputs + i * AIRTOUCH_ROLLING_GOLDEN_INPUTS;
      const int8_t *out = rollingInt8Step(&rolling, in);
      if (out && memcmp(out, expected, AIRTOUCH_ROLLING_GOLDEN_OUTPUTS)) return 1;
      expected += out ? AIRTOUCH_ROLLING_GOLDEN_OUTPUTS : 0;
    }
    if (expected != end) return 3;
  }
  const float small[] = {1e-9f, 1e-9f, 1e-9f}, large[] = {1e30f, 1e30f, 1e30f};
  float low[3], high[3];
  fixedScaleApply(&airtouchRollingScale, small, low);
  fixedScaleApply(&airtouchRollingScale, large, high);
  for (int i = 0; i < 3; i++) {
    if (low[i] != -FIXED_SCALE_LIMIT || high[i] != FIXED_SCALE_LIMIT) return 4;
  }
  return airtouchRollingScale.columns != 3;
}
"""


@pytest.mark.parametrize("main", [MAIN, STREAM_MAIN, ROLLING_MAIN], ids=["paper", "best", "paper-stream"])
def test_the_generated_sources_build_and_give_the_golden_answers(tmp_path: Path, main: str) -> None:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    (tmp_path / "main.c").write_text(main)
    sanitizers = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    flags = ["-std=c11", "-Os", "-Wall", "-Wextra", "-Werror", "-Wdouble-promotion", *sanitizers,
             *(f"-I{folder}" for folder in (KERNELS, FIRMWARE, MODEL))]
    sources = [path for folder in (KERNELS, FIRMWARE, MODEL) for path in sorted(folder.glob("*.c"))]
    objects, error = compiled(compiler, flags, sources)
    assert not error, error
    subprocess.run([compiler, *flags, str(tmp_path / "main.c"), *objects, "-lm", "-o", str(tmp_path / "golden")],
                   check=True)
    assert subprocess.run([str(tmp_path / "golden")]).returncode == 0


@pytest.mark.parametrize("sparsity", [0.0, 0.9])
def test_an_export_is_checked(tmp_path: Path, sparsity: float) -> None:
    model, other = random_model(1, sparsity), random_model(2, sparsity)
    files = export.export(model, tmp_path / "model")
    assert len(files) == 4
    export.check(model, tmp_path / "model")
    export.export(model, tmp_path / "model")  # nothing to change, nothing to refuse
    with pytest.raises(AirTouchError, match="--force"):
        export.export(other, tmp_path / "model")
    with pytest.raises(AirTouchError, match="stale or foreign"):
        export.check(other, tmp_path / "model")
    source = tmp_path / "model" / "airtouch_model.c"
    text = source.read_text()
    assert "LAYER_KERNEL(3, " in text
    source.write_text(text.replace("LAYER_KERNEL(3, ", "LAYER_KERNEL(4, ", 1))
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
