// height_port.c with stand-ins of the firmware: while one deck's task looks the variables up, the other's comes in.
#include <stdio.h>
#include <stdlib.h>

#include "../../../firmware/app/src/height_port.c"

static int lookups, readings, passedOn;
static bool within;

static void check(bool good, const char *what) {
  if (!good) {
    fprintf(stderr, "broken promise: %s\n", what);
    exit(1);
  }
}

static void read(float distance) {
  const measurement_t tof = {.type = MeasurementTypeTOF, .data.tof.distance = distance};
  __wrap_estimatorEnqueue(&tof);
}

logVarId_t logGetVarId(const char *group, const char *name) {
  (void)group;
  (void)name;
  lookups++;
  if (!within) {  // the other task comes in once before each look-up, and looks by itself
    within = true;
    read(0.8f);
    within = false;
  }
  return 7;
}

float logGetFloat(logVarId_t id) {
  check(id == 7, "a variable is read by an identifier that was looked up");
  readings++;
  return 0.0f;
}

bool supervisorIsFlying(void) { return true; }
TickType_t xTaskGetTickCount(void) { return 1000; }
void __real_estimatorEnqueue(const measurement_t *measurement) { passedOn += measurement->data.tof.distance == 0.8f; }

int main(void) {
  enable = 1;
  read(0.8f);
  check(passedOn > 1 && readings > 0, "both tasks pass their readings on, with the height");
  const int sought = lookups;
  read(0.8f);
  check(lookups == sought, "the table is searched at the start alone");
  printf("%s.%s %s.%s\n", logGroup, logs[0].name, paramGroup, params[0].name);
  return 0;
}
