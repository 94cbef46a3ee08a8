#pragma once

#include <stdbool.h>
#include <stdint.h>

typedef uint16_t logVarId_t;
typedef struct {
  uint16_t (*acquireUInt16)(uint32_t timestamp, void *data);
  void *data;
} logByFunction_t;
typedef struct {
  uint8_t type;
  const char *name;
  void *address;
} variableEntry_t;

enum { LOG_UINT8 = 1, LOG_UINT16 = 2, LOG_UINT32 = 3, LOG_FLOAT = 7, LOG_BY_FUNCTION = 0x40 };

logVarId_t logGetVarId(const char *group, const char *name);
static inline bool logVarIdIsValid(logVarId_t id) { return id != 0xffffu; }
float logGetFloat(logVarId_t id);

#define LOG_GROUP_START(NAME)                \
  static const char *const logGroup = #NAME; \
  static const variableEntry_t logs[] = {
#define LOG_ADD(TYPE, NAME, ADDRESS) {TYPE, #NAME, (void *)(ADDRESS)},
#define LOG_ADD_BY_FUNCTION(TYPE, NAME, ADDRESS) {TYPE | LOG_BY_FUNCTION, #NAME, (void *)(ADDRESS)},
#define LOG_GROUP_STOP(NAME) \
  {                          \
    0, NULL, NULL            \
  }                          \
  }                          \
  ;
