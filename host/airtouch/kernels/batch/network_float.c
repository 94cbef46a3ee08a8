#include "network_float.h"

#include <math.h>

static int32_t inputSize(const layerFloat_t *layer) { return layer->inRows * layer->inColumns * layer->inChannels; }

static int32_t outputSize(const layerFloat_t *layer) { return layer->outRows * layer->outColumns * layer->outChannels; }

static float dot(const float *a, const float *b, int32_t count) {
  float sum = 0.0f;
  for (int32_t i = 0; i < count; i++) {
    sum += a[i] * b[i];
  }
  return sum;
}

static float activation(const layerFloat_t *layer, float value) { return layer->relu && value < 0.0f ? 0.0f : value; }

static void conv(const layerFloat_t *layer, const float *input, float *output) {
  const int32_t span = layer->kernelColumns * layer->inChannels;
  const int32_t rowStride = layer->inColumns * layer->inChannels;
  for (int32_t row = 0; row < layer->outRows; row++) {
    for (int32_t column = 0; column < layer->outColumns; column++) {
      const float *patch = input + row * rowStride + column * layer->inChannels;
      const float *weights = layer->weights;
      for (int32_t channel = 0; channel < layer->outChannels; channel++) {
        float sum = layer->bias[channel];
        for (int32_t tap = 0; tap < layer->kernelRows; tap++, weights += span) {
          sum += dot(patch + tap * rowStride, weights, span);
        }
        *output++ = activation(layer, sum);
      }
    }
  }
}

static void maxPool(const layerFloat_t *layer, const float *input, float *output) {
  const int32_t channels = layer->inChannels;
  const int32_t rowStride = layer->inColumns * channels;
  for (int32_t row = 0; row < layer->outRows; row++) {
    for (int32_t column = 0; column < layer->outColumns; column++) {
      const float *block = input + row * layer->kernelRows * rowStride + column * layer->kernelColumns * channels;
      for (int32_t channel = 0; channel < channels; channel++) {
        float largest = block[channel];
        for (int32_t i = 0; i < layer->kernelRows; i++) {
          for (int32_t j = 0; j < layer->kernelColumns; j++) {
            largest = fmaxf(largest, block[i * rowStride + j * channels + channel]);
          }
        }
        *output++ = largest;
      }
    }
  }
}

static void dense(const layerFloat_t *layer, const float *input, float *output) {
  const int32_t inputs = inputSize(layer);
  for (int32_t channel = 0; channel < layer->outChannels; channel++) {
    output[channel] = activation(layer, layer->bias[channel] + dot(input, layer->weights + channel * inputs, inputs));
  }
}

int32_t networkFloatArenaSize(const networkFloat_t *network) {
  int32_t largest = 0;
  for (int32_t i = 0; i < network->layerCount; i++) {
    const layerFloat_t *layer = &network->layers[i];
    const int32_t size = (i > 0 ? inputSize(layer) : 0) + outputSize(layer);
    largest = size > largest ? size : largest;
  }
  return largest;
}

const float *networkFloatRun(const networkFloat_t *network, const float *input, float *arena) {
  const int32_t size = networkFloatArenaSize(network);
  const float *x = input;
  for (int32_t i = 0; i < network->layerCount; i++) {
    const layerFloat_t *layer = &network->layers[i];
    float *y = i % 2 == 0 ? arena : arena + size - outputSize(layer);
    switch (layer->kind) {
      case LAYER_CONV: conv(layer, x, y); break;
      case LAYER_MAX_POOL: maxPool(layer, x, y); break;
      default: dense(layer, x, y); break;
    }
    x = y;
  }
  return x;
}
