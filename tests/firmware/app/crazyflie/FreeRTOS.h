// As much of FreeRTOS as the app's shell uses. These stand-ins have the interfaces of crazyflie-firmware 2026.08;
// shell_driver.c and height_driver.c are behind them. The firmware's own headers take the same sources: see
// test_firmware.py.
#pragma once

#include <stdbool.h>
#include <stdint.h>

typedef uint32_t TickType_t;
typedef long BaseType_t;
#define pdTRUE 1
#define pdFALSE 0
#define M2T(milliseconds) ((TickType_t)(milliseconds))
