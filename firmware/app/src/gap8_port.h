/**
 * @file gap8_port.h
 * Packets to and from the GAP8, over the firmware's CPX. It is built in with the AI-deck's driver alone
 * (CONFIG=app-config-gap8): that driver's UART transport halts the drone on a damaged byte (host/docs/flash.md), so
 * without it there is nothing here, and with it nothing is sent or taken before the parameter `detector` asks for it.
 */
#pragma once

#include "app_core.h"

#ifdef CONFIG_DECK_AI

/** Whether the firmware found an AI-deck. */
bool gap8PortPresent(void);

/** Gives the core what came since the last step. Never waits. */
void gap8PortReceive(appCore_t *core);

/** Sends what the core has to say, if anything; the first packet also opens the way back. Never waits. */
void gap8PortSend(appCore_t *core);

#else

static inline bool gap8PortPresent(void) { return false; }
static inline void gap8PortReceive(appCore_t *core) { (void)core; }
static inline void gap8PortSend(appCore_t *core) { (void)core; }

#endif
