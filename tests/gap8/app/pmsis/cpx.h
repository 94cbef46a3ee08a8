// As much of lib/cpx of bitcraze/aideck-gap8-examples as gap8/app/src/main.c uses.
#pragma once

#include <stdbool.h>
#include <stdint.h>

typedef enum { CPX_T_STM32 = 1, CPX_T_ESP32 = 2, CPX_T_WIFI_HOST = 3, CPX_T_GAP8 = 4 } CPXTarget_t;
typedef enum { CPX_F_CONSOLE = 2, CPX_F_APP = 5 } CPXFunction_t;
typedef enum { LOG_TO_CRTP = CPX_T_STM32 } CPXConsoleTarget_t;
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
  uint8_t data[1020];
} CPXPacket_t;

void cpxInit(void);
void cpxReceivePacketBlocking(CPXFunction_t function, CPXPacket_t *packet);
void cpxEnableFunction(CPXFunction_t function);
void cpxSendPacketBlocking(const CPXPacket_t *packet);
void cpxInitRoute(const CPXTarget_t source, const CPXTarget_t destination, const CPXFunction_t function,
                  CPXRouting_t *route);
void cpxPrintToConsole(CPXConsoleTarget_t target, const char *fmt, ...);
