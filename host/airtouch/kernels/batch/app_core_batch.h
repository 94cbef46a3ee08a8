// The cores of both apps, as the virtual Crazyflie and the tests call them. Each lies in memory that the
// caller owns, aligned to 8 bytes, and never moves.
#include <stdint.h>

#include "app_types.h"
#include "kernel_types.h"

/** Bytes of an STM32 app's core, of a GAP8 app's, and of the largest packet. */
int64_t appHostBytes(void);
int64_t gap8HostBytes(void);
int64_t appHostPacketBytes(void);
/** The shipped settings; and settings put right, @return how many were changed. */
void appHostDefaults(appParams_t *params);
uint16_t appHostClamp(appParams_t *params);
/** Whether two settings are the same. */
int appHostSame(const appParams_t *one, const appParams_t *other);
/** See app_core.h. */
void appHostInit(void *core, const appParams_t *params, int haveGap8, uint32_t nonce);
void appHostSetVehicle(void *core, const airtouchVehicle_t *vehicle, float armPwm);
uint16_t appHostSetParams(void *core, appParams_t *params);
int appHostStep(void *core, const appSample_t *sample, appLog_t *log);
void appHostReceive(void *core, const uint8_t *bytes, uint16_t length);
uint16_t appHostOutgoing(void *core, uint8_t *bytes);
void appHostSent(void *core, int taken);
void appHostTime(void *core, uint32_t microseconds, int late);
int appHostStalled(uint32_t now, uint32_t lastStep, uint32_t limit);
/** See gap8_core.h; the networks are those of gap8/model. */
void gap8HostInit(void *core);
uint16_t gap8HostTake(void *core, const uint8_t *bytes, uint16_t length, uint8_t *reply);
uint16_t gap8HostHeartbeat(void *core, uint32_t uptimeMs, uint8_t *bytes);
