// How the processor starts, what is plugged into it, its memory and its clock.
#include <string.h>

#include "FreeRTOS.h"
#include "board.h"
#include "deck.h"
#include "deck_discovery.h"
#include "eeprom.h"
#include "stm32fxxx.h"
#include "task.h"

#define CLOCK_MHZ 168

static uint8_t memory[EEPROM_SIZE];

extern uint32_t _estack;
extern uint32_t g_pfnVectors;
void Reset_Handler(void);
// board.ld and build.py put these where the bootloader is, and where the firmware looks for its own of them.
__attribute__((section(".boot"), used)) static const void *const boot[2] = {&_estack, (const void *)Reset_Handler};
__attribute__((section(".device"), used)) static const char device[32] = DEVICE;  // build.py
__attribute__((section(".number"), used)) static const uint16_t number[10] = {1, 0, 2, 0, 3, 0, 0, 0, 0, 1024};

void __wrap_SystemInit(void) {
  SCB->CPACR |= 0xfu << 20;  // the FPU
  SCB->VTOR = (uint32_t)&g_pfnVectors;
  boardConnect();
  boardListen();
}

static bool deckBegin(void) { return true; }

static DeckInfo *nextDeck(void) {
  static DeckInfo info;
  static int given;
  static char *const all[] = {"bcFlow2", "bcAI"};
  if (given == 1 + board.deckThere) {
    return NULL;
  }
  memset(&info, 0, sizeof info);
  info.productName = all[given++];
  return &info;
}

static const DeckDiscoveryBackend_t emulated = {.name = "emulated", .init = deckBegin, .getNextDeck = nextDeck};
DECK_DISCOVERY_BACKEND(emulated);

void __wrap_usecTimerInit(void) {}

uint64_t __wrap_usecTimestamp(void) {
  uint32_t tick, left;
  if (board.wholeMilliseconds) {
    return 1000ull * xTaskGetTickCountFromISR();
  }
  do {
    tick = xTaskGetTickCountFromISR();
    left = SysTick->VAL;
    if ((SCB->ICSR & SCB_ICSR_PENDSTSET_Msk) && left > SysTick->LOAD / 2) {
      tick++;  // it has begun, and its interrupt waits
    }
  } while (left < SysTick->VAL);
  return 1000ull * tick + (SysTick->LOAD - left) / CLOCK_MHZ;
}

bool __wrap_eepromInit(I2C_Dev *port) {
  (void)port;
  return true;
}
bool __wrap_eepromTest(void) { return true; }
bool __wrap_eepromTestConnection(void) { return true; }
bool __wrap_eepromReadBuffer(uint8_t *buffer, uint16_t at, uint16_t length) {
  memcpy(buffer, memory + at, length);
  return true;
}
bool __wrap_eepromWriteBuffer(const uint8_t *buffer, uint16_t at, uint16_t length) {
  memcpy(memory + at, buffer, length);
  return true;
}
