// Log variables, parameters and tasks, by the firmware's own tables.
#include <string.h>

#include "FreeRTOS.h"
#include "board.h"
#include "log.h"
#include "param.h"
#include "task.h"

#define VARIABLES 64
#define ROW 15  // values of a recorded row, app_sensors.c

static logVarId_t watched[VARIABLES];
static int watchedCount;
static logVarId_t fed[ROW];
static uint32_t worstLatency;  // us, sensor interrupt to motors: the stabilizer's own, since the last report

static logVarId_t find(const char *name) {
  char group[32];
  const char *dot = strchr(name, '.');
  memcpy(group, name, (size_t)(dot - name));
  group[dot - name] = 0;
  return logGetVarId(group, dot + 1);
}

static void put(logVarId_t id, float value) {
  void *at = logGetAddress(id);
  switch (logGetType(id)) {
    case LOG_FLOAT: *(float *)at = value; break;
    case LOG_UINT16: *(uint16_t *)at = (uint16_t)value; break;
    case LOG_INT32: *(int32_t *)at = (int32_t)value; break;
    case LOG_UINT32: *(uint32_t *)at = (uint32_t)value; break;
    default: boardSay('!', "a log variable has another type", 31); boardStop(4);
  }
}

extern struct log_s _log_start[];

/** A value as the log task sends it: logGetUint() and its like know none that a function gives. */
static uint32_t get(logVarId_t id) {
  uint32_t bits;
  if (_log_start[id].type & LOG_BY_FUNCTION) {
    const logByFunction_t *by = _log_start[id].address;
    const uint32_t now = xTaskGetTickCount();
    switch (logGetType(id)) {
      case LOG_UINT8: return by->acquireUInt8(now, by->data);
      case LOG_UINT16: return by->acquireUInt16(now, by->data);
      case LOG_UINT32: return by->acquireUInt32(now, by->data);
      case LOG_INT8: return (uint32_t)by->acquireInt8(now, by->data);
      case LOG_INT16: return (uint32_t)by->acquireInt16(now, by->data);
      case LOG_INT32: return (uint32_t)by->acquireInt32(now, by->data);
      default: {
        const float value = by->aquireFloat(now, by->data);
        memcpy(&bits, &value, 4);
        return bits;
      }
    }
  }
  if (logGetType(id) == LOG_FLOAT) {
    const float value = logGetFloat(id);
    memcpy(&bits, &value, 4);
  } else if (logGetType(id) == LOG_INT16 || logGetType(id) == LOG_INT32 || logGetType(id) == LOG_INT8) {
    bits = (uint32_t)logGetInt(id);
  } else {
    bits = logGetUint(id);
  }
  return bits;
}

/** Names, each ended by a zero, into ids; their types go back, 0 for one that the firmware does not have. */
static void takeNames(const uint8_t *text, uint16_t length, logVarId_t *ids, int *count) {
  uint8_t types[VARIABLES] = {0};
  *count = 0;
  for (uint16_t at = 0; at < length && *count < VARIABLES; at += (uint16_t)strlen((const char *)text + at) + 1) {
    ids[*count] = find((const char *)text + at);
    types[*count] = logVarIdIsValid(ids[*count]) ? (uint8_t)logGetType(ids[*count]) : 0;
    (*count)++;
  }
  boardSay('T', types, (uint16_t)*count);
}

void boardWatch(const uint8_t *text, uint16_t length) { takeNames(text, length, watched, &watchedCount); }

void boardFeedNames(const uint8_t *text, uint16_t length) {
  int count;
  takeNames(text, length, fed, &count);
}

void boardFeed(const uint8_t *row) {
  for (int i = 0; i < ROW; i++) {
    float value;
    memcpy(&value, row + 4 * i, 4);
    put(fed[i], value);
  }
}

void boardSetParam(const uint8_t *bytes) {
  float value;
  memcpy(&value, bytes, 4);
  const paramVarId_t id = paramGetVarIdFromComplete((const char *)bytes + 4);
  if (!PARAM_VARID_IS_VALID(id)) {
    boardSay('!', "no such parameter", 17);
    boardStop(4);
  }
  if (paramGetType(id) == PARAM_FLOAT) {
    paramSetFloat(id, value);
  } else {
    paramSetInt(id, (int)value);
  }
}

void boardNoteLatency(void) {
  static logVarId_t latency;
  static bool known;
  if (!known) {
    known = true;
    latency = find("stabilizer.intToOut");
  }
  const uint32_t now = logGetUint(latency);
  worstLatency = now > worstLatency ? now : worstLatency;
}

void boardReport(uint8_t kind) {
  uint32_t values[VARIABLES + 2] = {xTaskGetTickCount(), worstLatency};
  for (int i = 0; i < watchedCount; i++) {
    values[2 + i] = get(watched[i]);
  }
  worstLatency = 0;
  boardSay(kind, values, (uint16_t)(4 * (2 + watchedCount)));
}

void boardStacks(void) {
  static TaskStatus_t tasks[40];
  // name, 10 bytes, and 2 of the count
  static struct __attribute__((packed)) {
    char name[10];
    uint16_t left;
  } row[40];
  const UBaseType_t count = uxTaskGetSystemState(tasks, 40, NULL);
  for (UBaseType_t i = 0; i < count; i++) {
    strncpy(row[i].name, tasks[i].pcTaskName, 10);
    row[i].left = tasks[i].usStackHighWaterMark;
  }
  boardSay('K', row, (uint16_t)(count * sizeof row[0]));
}
