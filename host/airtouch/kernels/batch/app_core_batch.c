#include "app_core_batch.h"

#include "app_core.h"
#include "gap8_core.h"

int64_t appHostBytes(void) { return sizeof(appCore_t); }

int64_t gap8HostBytes(void) { return sizeof(gap8Core_t); }

int64_t appHostPacketBytes(void) { return EDGE_LINK_MAX_BYTES; }

void appHostDefaults(appParams_t *params) { appParamsDefaults(params); }

uint16_t appHostClamp(appParams_t *params) { return appParamsClamp(params); }

int appHostSame(const appParams_t *one, const appParams_t *other) { return appParamsSame(one, other); }

void appHostInit(void *core, const appParams_t *params, int haveGap8, uint32_t nonce) {
  appCoreInit(core, params, haveGap8 != 0, nonce);
}

void appHostSetVehicle(void *core, const airtouchVehicle_t *vehicle, float armPwm) {
  appCoreSetVehicle(core, vehicle, armPwm);
}

uint16_t appHostSetParams(void *core, appParams_t *params) { return appCoreSetParams(core, params); }

int appHostStep(void *core, const appSample_t *sample, appLog_t *log) {
  const bool edge = appCoreStep(core, sample);
  *log = ((appCore_t *)core)->log;
  return edge;
}

void appHostReceive(void *core, const uint8_t *bytes, uint16_t length) { appCoreReceive(core, bytes, length); }

uint16_t appHostOutgoing(void *core, uint8_t *bytes) { return appCoreOutgoing(core, bytes); }

void appHostSent(void *core, int taken) { appCoreSent(core, taken != 0); }

void appHostTime(void *core, uint32_t microseconds, int late) { appCoreTime(core, microseconds, late != 0); }

int appHostStalled(uint32_t now, uint32_t lastStep, uint32_t limit) { return appStalled(now, lastStep, limit); }

void gap8HostInit(void *core) {
  const gap8Models_t models = GAP8_EXPORTED;
  gap8CoreInit(core, &models, NULL);
}

uint16_t gap8HostTake(void *core, const uint8_t *bytes, uint16_t length, uint8_t *reply) {
  return gap8CoreTake(core, bytes, length, reply);
}

uint16_t gap8HostHeartbeat(void *core, uint32_t uptimeMs, uint8_t *bytes) {
  return gap8CoreHeartbeat(core, uptimeMs, bytes);
}
