// The streaming detector kept open between calls: for samples that come one by one, from a drone or a file.
#include <stdint.h>

#include "kernel_types.h"
#include "stream_batch.h"

/** Bytes of a session. */
int64_t streamSessionBytes(void);
/** Opens a session in `session`, aligned to 8. Network, arena and session must outlive it and not move.
    arena: streamInt8BatchArena(network) bytes. Returns 0 for a network that does not fit. */
int32_t streamSessionOpen(void *session, const motionConfig_t *motion, const flatStreamInt8_t *network,
                          const streamQuantisation_t *quantisation, const decoderConfig_t *decoder, int8_t *arena);
/** The next samples: acc (samples, 3), gyro (samples, 3), PWM (samples, 4); one event each. */
void streamSessionNext(void *session, const float *acc, const float *gyro, const float *pwm, int64_t samples,
                       streamEvent_t *events);
