#pragma once

#include <stdint.h>

#include "log.h"

typedef struct {
  uint16_t id, index;
} paramVarId_t;

enum { PARAM_FLOAT = 6, PARAM_UINT8 = 8, PARAM_UINT16 = 9, PARAM_UINT32 = 10 };

#define PARAM_VARID_IS_VALID(varId) (varId.id != 0xffffu)
paramVarId_t paramGetVarId(const char *group, const char *name);
unsigned int paramGetUint(paramVarId_t varId);

#define PARAM_GROUP_START(NAME)                \
  static const char *const paramGroup = #NAME; \
  static const variableEntry_t params[] = {
#define PARAM_ADD(TYPE, NAME, ADDRESS) {TYPE, #NAME, (void *)(ADDRESS)},
#define PARAM_GROUP_STOP(NAME) \
  {                            \
    0, NULL, NULL              \
  }                            \
  }                            \
  ;
