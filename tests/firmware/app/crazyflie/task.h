#pragma once

#include "FreeRTOS.h"

TickType_t xTaskGetTickCount(void);
void vTaskDelayUntil(TickType_t *due, TickType_t period);
void taskENTER_CRITICAL(void);
void taskEXIT_CRITICAL(void);
