// Time: the tick, the gyro's interrupt, and the app's step.
#include "FreeRTOS.h"
#include "board.h"
#include "stm32fxxx.h"
#include "task.h"

static TaskHandle_t app;
static uint32_t appOut;

void __real_appMain(void);
void __wrap_appMain(void) {
  app = xTaskGetCurrentTaskHandle();
  if (board.mode != BOARD_FLYING) {
    boardMeet();
  }
  if (!board.appRuns) {
    vTaskDelay(portMAX_DELAY);
  }
  __real_appMain();
}

/** A step of the app ends where it begins to wait for the next. */
void __real_vTaskDelayUntil(TickType_t *due, const TickType_t period);
void __wrap_vTaskDelayUntil(TickType_t *due, const TickType_t period) {
  const bool step = app != NULL && xTaskGetCurrentTaskHandle() == app;
  if (step && appOut++ > 0) {
    boardReport('S');
  }
  __real_vTaskDelayUntil(due, period);
  if (step && board.mode != BOARD_FLYING) {
    if (board.deckThere) {
      boardSay('A', NULL, 0);  // its turn, and not the deck's
      boardListenAlone();
    } else {
      boardListen();
    }
  }
  if (board.ending) {
    boardStacks();
    boardStop(0);
  }
}

/** QEMU's EXTI raises no line by software: the gyro's is asked for here. */
static bool gyroWaits;
ITStatus __real_EXTI_GetITStatus(uint32_t line);
ITStatus __wrap_EXTI_GetITStatus(uint32_t line) {
  if (line == EXTI_Line14 && gyroWaits) {
    gyroWaits = false;
    return SET;
  }
  return __real_EXTI_GetITStatus(line);
}

/** Every millisecond: the gyro's interrupt; every second one new samples, and the motors go out. */
BaseType_t __real_xTaskIncrementTick(void);
BaseType_t __wrap_xTaskIncrementTick(void) {
  static bool odd;
  const BaseType_t woken = __real_xTaskIncrementTick();
  if (board.mode == BOARD_FLYING && board.sensing && !board.ending) {
    odd = !odd;
    board.millisecond = 1;
    if (odd) {
      boardMeet();
    }
    boardNoteLatency();
    if (odd) {
      boardReport('M');
      boardListen();
    }
    gyroWaits = true;
    NVIC_SetPendingIRQ(EXTI15_10_IRQn);
  }
  return woken;
}
