// Golden windows through the shipped network on several threads, one a core: for tests/gap8/kernels/test_team.py.
// Usage: team CORES REPEATS. Prints "same" where every core got the golden outputs each time.
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "airtouch_golden.h"
#include "airtouch_model.h"
#include "airtouch_rolling.h"

static pthread_barrier_t barrier;
static _Alignas(4) int8_t arena[AIRTOUCH_MODEL_ARENA_BYTES];
static int repeats;

typedef struct {
  const networkInt8_t *network;
  teamInt8_t team;
  int8_t outputs[AIRTOUCH_GOLDEN_COUNT][AIRTOUCH_GOLDEN_OUTPUTS];
} core_t;

static void wait(void *context) { pthread_barrier_wait(context); }

static void *run(void *argument) {
  core_t *core = argument;
  for (int i = 0; i < repeats * AIRTOUCH_GOLDEN_COUNT; i++) {
    const int window = i % AIRTOUCH_GOLDEN_COUNT;
    const int8_t *input = airtouchGoldenInputs + window * AIRTOUCH_GOLDEN_INPUTS;
    const int8_t *result = networkInt8RunTeam(core->network, input, arena, &core->team);
    memcpy(core->outputs[window], result, AIRTOUCH_GOLDEN_OUTPUTS);
    wait(&barrier);  // all have read the output before the next window goes into the arena
  }
  return NULL;
}

static int team(const networkInt8_t *network, int cores, const int8_t *expected) {
  static core_t members[8];
  pthread_t threads[8];
  pthread_barrier_init(&barrier, NULL, (unsigned)cores);
  for (int i = 0; i < cores; i++) {
    members[i] = (core_t){.network = network, .team = {i, cores, wait, &barrier}};
    pthread_create(&threads[i], NULL, run, &members[i]);
  }
  int same = 1;
  for (int i = 0; i < cores; i++) {
    pthread_join(threads[i], NULL);
    same = same && memcmp(members[i].outputs, expected, sizeof(members[i].outputs)) == 0;
  }
  pthread_barrier_destroy(&barrier);
  return same;
}

int main(int argc, char **argv) {
  const int cores = argc > 1 ? atoi(argv[1]) : 0;
  repeats = argc > 2 ? atoi(argv[2]) : 1;
  if (cores < 1 || cores > 8 || networkInt8ArenaBytes(&airtouchRolling) > AIRTOUCH_MODEL_ARENA_BYTES) {
    return 2;
  }
  // The sparse convolution of the rolling network as well; one core alone says what is right there.
  int8_t alone[AIRTOUCH_GOLDEN_COUNT * AIRTOUCH_GOLDEN_OUTPUTS];
  for (int i = 0; i < AIRTOUCH_GOLDEN_COUNT; i++) {
    const int8_t *result = networkInt8Run(&airtouchRolling, airtouchGoldenInputs + i * AIRTOUCH_GOLDEN_INPUTS, arena);
    memcpy(alone + i * AIRTOUCH_GOLDEN_OUTPUTS, result, AIRTOUCH_GOLDEN_OUTPUTS);
  }
  const int same = team(&airtouchNetwork, cores, airtouchGoldenOutputs) && team(&airtouchRolling, cores, alone);
  printf(same ? "same\n" : "different\n");
  return !same;
}
