// motion_channels.h: any samples, held against the channels' definition in double, over the whole past.
#include "airtouch_stream.h"
#include "motion_channels.h"
#include "sample_guard.h"

#include "fuzz.h"

#define SAMPLES 400

typedef struct {
  double slow[4], slowThrust, lagged, delayed[MOTION_THRUST_DELAY];
  uint32_t airborne;
  bool started;
  float held[10];
  double largest[2];  // of any acceleration or rate, and of thrust: what rounding is measured by
} truth_t;

static double thrustOf(const airtouchVehicle_t *vehicle, const float pwm[4]) {
  double thrust = 0.0;
  for (int i = 0; i < 4; i++) {
    const double p = pwm[i];
    thrust += p > 0.0 ? vehicle->thrust[0] + p * vehicle->thrust[1] + p * p * vehicle->thrust[2] : 0.0;
  }
  return thrust;
}

static void follow(truth_t *truth, const motionConfig_t *config, const double motors[4], double thrust) {
  if (!truth->started) {
    memcpy(truth->slow, motors, sizeof truth->slow);
    truth->slowThrust = truth->lagged = truth->delayed[0] = truth->delayed[1] = thrust;
    truth->started = true;
  }
  truth->lagged += config->lagGain * (truth->delayed[0] - truth->lagged);
  truth->delayed[0] = truth->delayed[1];
  truth->delayed[1] = thrust;
  const double gain = truth->airborne > config->settleSamples ? config->slowGain : 1.0;
  for (int i = 0; i < 4; i++) {
    truth->slow[i] += gain * (motors[i] - truth->slow[i]);
  }
  truth->slowThrust += gain * (truth->lagged - truth->slowThrust);
}

static void checkChannels(const truth_t *truth, const motionConfig_t *config, const double motors[4],
                          const float *channels) {
  double right[MOTION_CHANNELS - 1];
  const double usual = fmax(truth->slowThrust, config->leastThrust);
  for (int i = 0; i < 6; i++) {
    right[i] = truth->held[i] - (i == 2 ? config->vehicle.gravity : 0.0);
  }
  for (int i = 0; i < 4; i++) {
    right[6 + i] = motors[i] - truth->slow[i];
  }
  right[10] = truth->held[2] - config->vehicle.gravity * truth->lagged / usual;
  for (int i = 0; i < MOTION_CHANNELS - 1; i++) {
    const double scaled = right[i] * config->inverseScale[i];
    const double limited = fmax(-config->limit, fmin(scaled, config->limit));
    // Sums of PWM round in units of 4 x 65535, what gravity is taken off in those of the sample.
    const double magnitude =
        i >= 6 && i < 10 ? 262140.0 : fabs(truth->held[i < 6 ? i : 2]) + 20.0 * (1.0 + truth->lagged / usual);
    CHECK(fabsf(channels[i]) <= config->limit, "a channel is within the limit");
    CHECK(fabs(channels[i] - limited) <= 64.0 * FLT_EPSILON * (magnitude * config->inverseScale[i] + fabs(limited)),
          "a channel is that of the definition");
  }
  CHECK(channels[MOTION_CHANNELS - 1] == 0.0f, "the last channel is empty");
}

static void step(motionChannels_t *motion, truth_t *truth, const motionConfig_t *config, const float *sample) {
  float channels[MOTION_CHANNELS];
  for (int i = 0; i < 10; i++) {
    const float most = i < 3 ? ACC_LIMIT : (i < 6 ? RATE_LIMIT : PWM_LIMIT);
    if (isfinite(sample[i])) {
      truth->held[i] = fminf(fmaxf(sample[i], i < 6 ? -most : 0.0f), most);
    }
  }
  const float *m = truth->held + 6;
  const double motors[4] = {(double)m[2] + m[3] - m[0] - m[1], (double)m[0] + m[3] - m[1] - m[2],
                            (double)m[0] + m[2] - m[1] - m[3], 0.25 * ((double)m[0] + m[1] + m[2] + m[3])};
  motionChannelsStep(motion, sample, sample + 3, sample + 6, channels);
  const double margin = fabs(motors[3] - config->armPwm);
  truth->airborne = motors[3] > config->armPwm ? truth->airborne + 1 : 0;
  CHECK(margin < 0.1 || motion->airborneSteps == truth->airborne, "airborne while the mean PWM is above the setting");
  truth->airborne = motion->airborneSteps;
  follow(truth, config, motors, thrustOf(&config->vehicle, m));
  checkChannels(truth, config, motors, channels);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  bytes_t bytes = {data, size};
  motionConfig_t config = airtouchStreamMotion;
  const uint8_t kind = takeByte(&bytes);
  if (kind & 1) {
    config.slowGain = (float)(1 + takeByte(&bytes)) / 256.0f;
    config.lagGain = (float)(1 + takeByte(&bytes)) / 256.0f;
    config.armPwm = takeFinite(&bytes, 2e4f, 1e6f);
    config.settleSamples = takeByte(&bytes);
    config.limit = (float)(1 + takeByte(&bytes)) / 8.0f;
    config.leastThrust = (float)(1 + takeByte(&bytes)) / 256.0f;
  }
  motionChannels_t *motion = rubbish(sizeof *motion, 0xa5);
  motionChannelsInit(motion, &config);
  truth_t truth = {.started = false};
  uint32_t seed = kind;
  for (int count = 0; count == 0 || (count < SAMPLES && bytes.left > 0);) {
    const uint8_t what = takeByte(&bytes);
    float sample[10];
    for (int run = what & 1 ? 0 : what / 2; run >= 0 && count < SAMPLES; run--, count++) {
      for (int i = 0; i < 10; i++) {
        sample[i] =
            what & 1 ? takeFloat(&bytes, i < 6 ? 10.0f : 3e4f) : (i < 6 ? noise(&seed) : 4e4f + 4e3f * noise(&seed));
      }
      step(motion, &truth, &config, sample);
    }
  }
  free(motion);
  return 0;
}
