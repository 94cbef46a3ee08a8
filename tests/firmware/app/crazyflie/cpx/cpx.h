// Apart from the others: only a build with the AI-deck's driver finds it.
#pragma once

#include <stdbool.h>
#include <stdint.h>

#define CPX_MAX_PAYLOAD_SIZE 100

typedef enum { CPX_T_STM32 = 1, CPX_T_WIFI_HOST = 3, CPX_T_GAP8 = 4 } CPXTarget_t;
typedef enum { CPX_F_APP = 5 } CPXFunction_t;
typedef struct {
  CPXTarget_t destination;
  CPXTarget_t source;
  bool lastPacket;
  CPXFunction_t function;
  uint8_t version;
} CPXRouting_t;
typedef struct {
  CPXRouting_t route;
  uint16_t dataLength;
  uint8_t data[CPX_MAX_PAYLOAD_SIZE];
} CPXPacket_t;
typedef void (*cpxAppMessageHandlerCallback_t)(const CPXPacket_t *cpxRx);

void cpxInitRoute(const CPXTarget_t source, const CPXTarget_t destination, const CPXFunction_t function,
                  CPXRouting_t *route);
void cpxRegisterAppMessageHandler(cpxAppMessageHandlerCallback_t callback);
