// What the emulator calls: the kernels of firmware/kernels with their states, a step at a time. States are
// variables here, so that the program's symbols say how much RAM each takes.
#include <stddef.h>

#include "airtouch_stream.h"
#include "cross_spectrum.h"
#include "disturbance_force.h"
#include "edge_pipeline.h"
#include "stream_detector.h"

edgePipeline_t edgePipelineState;
streamDetector_t streamDetectorState;
_Alignas(4) int8_t streamArena[AIRTOUCH_STREAM_ARENA_BYTES];
bandPower_t bandPowerState;
float bandPowerStorage[EDGE_PIPELINE_BAND_FLOATS];
frCfar_t frCfarState;
float frCfarStorage[EDGE_PIPELINE_MAX_CELLS];
motionChannels_t motionChannelsState;
edgeDecoder_t edgeDecoderState;

static const uint16_t axes[3] = {3, 3, 3};

/** Everything at its start, the pipeline with @p config, the detector as exported. Returns 1, or 0 if refused. */
int32_t flightBegin(const edgePipelineConfig_t *config) {
  motionChannelsInit(&motionChannelsState, &airtouchStreamMotion);
  edgeDecoderInit(&edgeDecoderState, &airtouchStreamDecoder);
  return edgePipelineInit(&edgePipelineState, config) &&
         bandPowerInit(&bandPowerState, config->sampleRateHz, config->window, config->lowHz, config->highHz,
                       config->hop, EDGE_PIPELINE_CHANNELS, bandPowerStorage, EDGE_PIPELINE_BAND_FLOATS) &&
         frCfarInit(&frCfarState, config->leadingWindow, config->guardCells, config->pFa, frCfarStorage,
                    EDGE_PIPELINE_MAX_CELLS) &&
         streamDetectorInit(&streamDetectorState, &airtouchStreamMotion, &airtouchStream, &airtouchStreamQuantisation,
                            &airtouchStreamDecoder, streamArena);
}

int32_t stepEdgePipeline(const edgeSample_t *sample, edgeEvent_t *event) {
  edgePipelineStep(&edgePipelineState, sample, event);
  return event->ready;
}

int32_t stepBandPower(const float channels[9], float power[9]) {
  return bandPowerStep(&bandPowerState, channels, power);
}

int32_t stepCrossSpectrum(const float power[9], float features[3]) {
  cascadedCrossSpectrum(power, axes, 3, features);
  return 1;
}

int32_t stepDisturbanceForce(const edgeSample_t *sample, edgeEvent_t *event) {
  const airtouchVehicle_t *vehicle = &edgePipelineState.config.vehicle;
  const float up[3] = {0.0f, 0.0f, 1.0f};
  const float thrust = totalThrust(vehicle, sample->pwm) * voltageFactor(vehicle, sample->vbat);
  disturbanceForce(vehicle, sample->acc, thrust, up, event->force);
  event->forceNorm = forceNorm(event->force);
  return 1;
}

int32_t stepFrCfar(const float *power, float *threshold) {
  frCfarStep(&frCfarState, *power, threshold);
  return threshold[0] == threshold[0];
}

int32_t stepMotionChannels(const edgeSample_t *sample, float channels[MOTION_CHANNELS]) {
  motionChannelsStep(&motionChannelsState, sample->acc, sample->gyro, sample->pwm, channels);
  return 1;
}

int32_t stepStreamInt8(const int8_t quantised[MOTION_CHANNELS], int8_t *unused) {
  (void)unused;
  return streamInt8Step(&airtouchStream, &streamDetectorState.state, quantised) != NULL;
}

int32_t stepEdgeDecoder(const float logits[EDGE_DECODER_LOGITS], uint8_t *edge) {
  *edge = edgeDecoderStep(&edgeDecoderState, logits, true);
  return 1;
}

int32_t stepStreamDetector(const edgeSample_t *sample, streamEvent_t *event) {
  streamDetectorStep(&streamDetectorState, sample->acc, sample->gyro, sample->pwm, event);
  return event->ready;
}
