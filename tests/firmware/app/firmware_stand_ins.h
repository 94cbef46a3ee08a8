// Stand-ins of the firmware around the app: time, tasks, log variables, parameters, CPX with a GAP8 behind it.
// For shell_driver.c alone, after airtouch_app.c: the scenarios set what the stand-ins do.
#pragma once

#define HIDDEN 0xffffu
#define HOVER_PWM 42000.0f

static void check(bool good, const char *what) {
  if (!good) {
    fprintf(stderr, "broken promise: %s\n", what);
    abort();
  }
}

// ---- time and tasks

static TickType_t tick = 5000;
static jmp_buf landed;
static int stepsLeft;
static TickType_t delay;              // ticks that the next step begins late
static void (*between)(int step);     // runs before each step, as another task would
static void (*afterClock)(void);      // runs once, right after the clock was read
static void (*beforeCritical)(void);  // runs once, as a task that comes in just before interrupts go off
static int critical;

TickType_t xTaskGetTickCount(void) {
  const TickType_t now = tick;
  if (afterClock != NULL) {
    void (*const task)(void) = afterClock;
    afterClock = NULL;
    task();
  }
  return now;
}

void vTaskDelayUntil(TickType_t *due, TickType_t period) {
  static int count;
  if (stepsLeft-- == 0) {
    longjmp(landed, 1);
  }
  *due += period;
  if ((int32_t)(*due - tick) > 0) {
    tick = *due;
  }
  tick += delay;
  delay = 0;
  if (between != NULL) {
    between(count);
  }
  count++;
}

void taskENTER_CRITICAL(void) {
  if (beforeCritical != NULL) {
    void (*const task)(void) = beforeCritical;
    beforeCritical = NULL;
    task();
  }
  critical++;
}

void taskEXIT_CRITICAL(void) { check(critical-- > 0, "critical sections are balanced"); }
uint64_t usecTimestamp(void) { return 1000u * (uint64_t)tick; }

void debugPrint(const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  vprintf(format, arguments);
  va_end(arguments);
}

static void fly(int steps) {
  stepsLeft = steps;
  if (setjmp(landed) == 0) {
    appMain();
  }
  check(critical == 0, "interrupts are on again");
}

// ---- log variables and parameters

static const char *const names[] = {"stateEstimate.ax", "stateEstimate.ay", "stateEstimate.az", "gyro.x",
                                    "gyro.y",           "gyro.z",           "motor.m1",         "motor.m2",
                                    "motor.m3",         "motor.m4",         "pm.vbat",          "stateEstimate.qx",
                                    "stateEstimate.qy", "stateEstimate.qz", "stateEstimate.qw"};
static const float values[] = {0, 0, 0, 0, 0, 0, HOVER_PWM, HOVER_PWM, HOVER_PWM, HOVER_PWM, 3.8f, 0, 0, 0, 1};
static const char *hidden = "";
static unsigned int deck = 1;

logVarId_t logGetVarId(const char *group, const char *name) {
  char whole[64];
  snprintf(whole, sizeof whole, "%s.%s", group, name);
  for (unsigned i = 0; i < sizeof names / sizeof *names; i++) {
    if (strcmp(names[i], whole) == 0 && strcmp(hidden, whole) != 0) {
      return (logVarId_t)i;
    }
  }
  return HIDDEN;
}

float logGetFloat(logVarId_t id) {
  check(id < sizeof values / sizeof *values, "logGetFloat() gets a valid identifier: it halts the drone on others");
  return values[id] + (id < 2 ? 1e-4f * (float)(tick % 7) : 0.0f);  // no two samples are the same in flight
}

paramVarId_t paramGetVarId(const char *group, const char *name) {
  const bool there = deck != HIDDEN && strcmp(group, "deck") == 0 && strcmp(name, "bcAI") == 0;
  return (paramVarId_t){.id = there ? 0 : HIDDEN, .index = there ? 0 : HIDDEN};
}

unsigned int paramGetUint(paramVarId_t id) {
  check(PARAM_VARID_IS_VALID(id), "paramGetUint() gets a valid identifier: it halts the drone on others");
  return deck;
}

// ---- CPX and the GAP8

static int sent, registered;

#ifdef CONFIG_DECK_AI
#include "app_core_batch.h"
#include "cpx_internal_router.h"
#include "queue.h"

static void *gap8;
static cpxAppMessageHandlerCallback_t handler;

QueueHandle_t xQueueCreateStatic(uint32_t slots, uint32_t size, uint8_t *storage, StaticQueue_t *memory) {
  *memory = (StaticQueue_t){storage, slots, size, 0, 0};
  return memory;
}

BaseType_t xQueueSend(QueueHandle_t queue, const void *item, TickType_t wait) {
  check(queue != NULL && wait == 0, "the app never waits for a queue");
  if (queue->count == queue->slots) {
    return pdFALSE;
  }
  memcpy(queue->storage + (queue->first + queue->count++) % queue->slots * queue->size, item, queue->size);
  return pdTRUE;
}

BaseType_t xQueueReceive(QueueHandle_t queue, void *item, TickType_t wait) {
  check(queue != NULL && wait == 0, "the app never waits for a queue");
  if (queue->count == 0) {
    return pdFALSE;
  }
  memcpy(item, queue->storage + queue->first * queue->size, queue->size);
  queue->first = (queue->first + 1) % queue->slots;
  queue->count--;
  return pdTRUE;
}

void cpxInitRoute(const CPXTarget_t source, const CPXTarget_t destination, const CPXFunction_t function,
                  CPXRouting_t *route) {
  *route = (CPXRouting_t){.source = source, .destination = destination, .function = function};
}

void cpxRegisterAppMessageHandler(cpxAppMessageHandlerCallback_t callback) {
  registered++;
  handler = callback;
}

static void answer(CPXTarget_t source, const uint8_t *bytes, uint16_t length) {
  CPXPacket_t packet = {.dataLength = length};
  cpxInitRoute(source, CPX_T_STM32, CPX_F_APP, &packet.route);
  memcpy(packet.data, bytes, length < CPX_MAX_PAYLOAD_SIZE ? length : CPX_MAX_PAYLOAD_SIZE);
  handler(&packet);
}

bool cpxSendPacketBlockingTimeout(const CPXPacket_t *packet, const uint32_t timeout) {
  uint8_t reply[EDGE_LINK_MAX_BYTES];
  check(timeout == 0, "the app never waits for CPX");
  check(packet->route.destination == CPX_T_GAP8 && packet->route.function == CPX_F_APP, "packets go to the GAP8's app");
  check(packet->dataLength <= 98, "the firmware's UART transport asserts on longer packets");
  check(handler != NULL, "answers are taken before questions are asked");
  if (sent++ == 0) {
    gap8 = aligned_alloc(8, ((size_t)gap8HostBytes() + 7) / 8 * 8);
    gap8HostInit(gap8);
  }
  const uint16_t length = gap8HostTake(gap8, packet->data, packet->dataLength, reply);
  if (length > 0) {
    answer(CPX_T_GAP8, reply, length);
  }
  return true;
}
#endif
