#pragma once

#include "cpx.h"

bool cpxSendPacketBlockingTimeout(const CPXPacket_t *packet, const uint32_t timeout);
