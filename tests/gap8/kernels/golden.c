// The golden vectors of the three shipped networks through the kernels of one build: for
// tests/gap8/kernels/test_extensions.py. Prints how many outputs were compared, "different" where one is another.
#include <stdio.h>
#include <string.h>

#include "airtouch_golden.h"
#include "airtouch_model.h"
#include "airtouch_rolling.h"
#include "airtouch_rolling_golden.h"
#include "airtouch_stream.h"
#include "airtouch_stream_golden.h"

static int same = 1;
static int compared;

static void compare(const int8_t *found, const int8_t *expected, int count) {
  same = same && memcmp(found, expected, (size_t)count) == 0;
  compared += count;
}

static void windows(void) {
  static _Alignas(4) int8_t arena[AIRTOUCH_MODEL_ARENA_BYTES];
  for (int i = 0; i < AIRTOUCH_GOLDEN_COUNT; i++) {
    const int8_t *input = airtouchGoldenInputs + i * AIRTOUCH_GOLDEN_INPUTS;
    compare(networkInt8Run(&airtouchNetwork, input, arena), airtouchGoldenOutputs + i * AIRTOUCH_GOLDEN_OUTPUTS,
            AIRTOUCH_GOLDEN_OUTPUTS);
  }
}

static void rolling(void) {
  static _Alignas(4) int8_t arena[AIRTOUCH_ROLLING_ARENA_BYTES];
  static rollingInt8_t state;
  const int8_t *expected = airtouchRollingGoldenOutputs;
  same = same && rollingInt8Init(&state, &airtouchRolling, AIRTOUCH_ROLLING_STRIDE, arena);
  for (int i = 0; same && expected < airtouchRollingGoldenOutputs + sizeof airtouchRollingGoldenOutputs; i++) {
    const int8_t *found = rollingInt8Step(&state, airtouchRollingGoldenInputs + i * AIRTOUCH_ROLLING_COLUMNS);
    if (found != NULL) {
      compare(found, expected, AIRTOUCH_ROLLING_OUTPUTS);
      expected += AIRTOUCH_ROLLING_OUTPUTS;
    }
  }
}

static void stream(void) {
  static _Alignas(4) int8_t arena[AIRTOUCH_STREAM_ARENA_BYTES];
  streamState_t state;
  const int8_t *expected = airtouchStreamGoldenOutputs;
  streamInt8Reset(&airtouchStream, &state, arena);
  for (int i = 0; i < AIRTOUCH_STREAM_GOLDEN_COUNT; i++) {
    const int8_t *found =
        streamInt8Step(&airtouchStream, &state, airtouchStreamGoldenInputs + i * AIRTOUCH_STREAM_GOLDEN_INPUTS);
    if (found != NULL) {
      compare(found, expected, AIRTOUCH_STREAM_GOLDEN_OUTPUTS);
      expected += AIRTOUCH_STREAM_GOLDEN_OUTPUTS;
    }
  }
}

int main(void) {
  windows();
  rolling();
  stream();
  printf(same ? "%d same\n" : "%d different\n", compared);
  return !same;
}
