// The two serial lines: the radio's processor with its syslink packets, and UART2, where the AI-deck is.
#include "FreeRTOS.h"
#include "board.h"
#include "queue.h"
#include "syslink.h"
#include "stm32fxxx.h"

static SyslinkPacket radioStorage[8];
static StaticQueue_t radioMemory;
static QueueHandle_t radio;

void __wrap_uartslkInit(void) {
  radio = xQueueCreateStatic(8, sizeof(SyslinkPacket), (uint8_t *)radioStorage, &radioMemory);
}

bool __wrap_uartslkTest(void) { return true; }

void __wrap_uartslkGetPacketBlocking(SyslinkPacket *packet) { xQueueReceive(radio, packet, portMAX_DELAY); }

void __wrap_uartslkSendDataDmaBlocking(uint32_t size, uint8_t *data) {
  if (data[2] < SYSLINK_PM_GROUP) {
    boardSay('L', data + 2, (uint16_t)(size - 4));  // less start and checksum
  } else if (data[2] == SYSLINK_OW_SCAN) {
    SyslinkPacket none = {.type = SYSLINK_OW_SCAN, .length = 1};
    xQueueSend(radio, &none, 0);
  }
}

static uint8_t deckBytes[512];
static StaticQueue_t deckMemory;
static QueueHandle_t deckQueue;

void __wrap_uart2Init(const uint32_t baudrate) {
  (void)baudrate;
  if (deckQueue == NULL) {
    deckQueue = xQueueCreateStatic(sizeof deckBytes, 1, deckBytes, &deckMemory);
  }
}

int __wrap_uart2GetDataWithTimeout(size_t size, uint8_t *buffer, const uint32_t ticks) {
  for (size_t i = 0; i < size; i++) {
    if (xQueueReceive(deckQueue, &buffer[i], ticks) != pdTRUE) {
      return (int)i;
    }
  }
  return (int)size;
}

int __wrap_uart2GetData(size_t size, uint8_t *buffer) {
  return __wrap_uart2GetDataWithTimeout(size, buffer, portMAX_DELAY);
}

/** What the deck says to that is here before the next byte goes out. */
void __wrap_uart2SendData(uint32_t size, uint8_t *data) {
  boardSay('U', data, (uint16_t)size);
  if (board.deckThere) {
    boardListenAlone();
  }
}

static void enqueue(QueueHandle_t queue, const void *item) {
  if (queue == NULL) {
    return;
  }
  if (__get_IPSR() == 0) {
    xQueueSend(queue, item, 0);
  } else {
    BaseType_t woken = pdFALSE;
    xQueueSendFromISR(queue, item, &woken);
    portYIELD_FROM_ISR(woken);
  }
}

void boardRadioGives(const void *packet) { enqueue(radio, packet); }

void boardDeckGives(const uint8_t *bytes, uint16_t length) {
  for (uint16_t i = 0; i < length; i++) {
    enqueue(deckQueue, &bytes[i]);
  }
}
