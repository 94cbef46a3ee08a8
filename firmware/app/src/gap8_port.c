#include <string.h>

#include "FreeRTOS.h"
#include "queue.h"

#include "autoconf.h"
#include "cpx.h"
#include "cpx_internal_router.h"
#include "param.h"

#include "gap8_port.h"

#define INBOX 4

typedef struct {
  uint8_t length;
  uint8_t bytes[EDGE_LINK_MAX_BYTES];
} appPacket_t;

static uint8_t inboxStorage[INBOX * sizeof(appPacket_t)];
static StaticQueue_t inboxMemory;
static QueueHandle_t inbox;  // NULL until the first packet is sent

/** Runs in the CPX task: copies the packet and returns. */
static void takePacket(const CPXPacket_t *received) {
  static appPacket_t packet;  // of the one CPX task
  if (received->route.source != CPX_T_GAP8 || received->dataLength > EDGE_LINK_MAX_BYTES) {
    return;
  }
  packet.length = (uint8_t)received->dataLength;
  memcpy(packet.bytes, received->data, packet.length);
  xQueueSend(inbox, &packet, 0);  // full: the GAP8's next answer repeats what this one said
}

bool gap8PortPresent(void) {
  const paramVarId_t deck = paramGetVarId("deck", "bcAI");
  return PARAM_VARID_IS_VALID(deck) && paramGetUint(deck) != 0;
}

void gap8PortReceive(appCore_t *core) {
  static appPacket_t packet;
  while (inbox != NULL && xQueueReceive(inbox, &packet, 0) == pdTRUE) {
    appCoreReceive(core, packet.bytes, packet.length);
  }
}

void gap8PortSend(appCore_t *core) {
  static CPXPacket_t packet;
  for (int i = 0; i < APP_PACKETS; i++) {
    packet.dataLength = appCoreOutgoing(core, packet.data);
    if (packet.dataLength == 0) {
      return;
    }
    if (inbox == NULL) {
      inbox = xQueueCreateStatic(INBOX, sizeof(appPacket_t), inboxStorage, &inboxMemory);
      cpxRegisterAppMessageHandler(takePacket);
    }
    cpxInitRoute(CPX_T_STM32, CPX_T_GAP8, CPX_F_APP, &packet.route);
    appCoreSent(core, cpxSendPacketBlockingTimeout(&packet, 0));
  }
}
