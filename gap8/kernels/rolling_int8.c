#include "rolling_int8.h"

#include <stddef.h>
#include <string.h>

#include "conv_int8.h"

static bool isConv(const layerInt8_t *layer) { return layer->kind == LAYER_CONV || layer->kind == LAYER_SPARSE_CONV; }

/** Whether a layer slides over the rows of its input. */
static bool slides(const layerInt8_t *layer) { return isConv(layer) || layer->kind == LAYER_MAX_POOL; }

/**
 * How far apart neighbouring rows of a layer's input lie, in samples: in the window, and as the rolling network
 * computes them. A pool multiplies both, until the second reaches the stride.
 */
typedef struct {
  int32_t window;
  int32_t rolling;
} spacing_t;

/** A step of one layer, for one row of output: as many rows of input as it reads for that. */
static void beginStep(rollingStep_t *step, const layerInt8_t *layer) {
  step->layer = *layer;
  if (slides(layer)) {
    step->layer.inRows = layer->kernelRows;
    step->layer.outRows = 1;
  }
  step->taps = 1;
  step->dilation = 1;
  step->period = 1;
}

/** A convolution whose rows only the pool reads: both at once, the rows never stored. */
static void joinPool(rollingStep_t *step, const layerInt8_t *conv, const layerInt8_t *pool) {
  step->pool = *pool;
  step->pool.inRows = pool->kernelRows;
  step->pool.outRows = 1;
  step->layer.outRows = pool->kernelRows;
  step->layer.inRows = conv->kernelRows + pool->kernelRows - 1;
  step->taps = step->layer.inRows;
  step->period = pool->kernelRows;
}

static void passPool(rollingInt8_t *self, const layerInt8_t *pool, spacing_t *spacing) {
  self->ahead += pool->inRows % pool->kernelRows * spacing->window;  // the rows that it drops are the window's newest
  spacing->window *= pool->kernelRows;
}

/** Plans a convolution or a pool, and the pool behind a convolution where both are one step. @return layers planned */
static int32_t planSliding(rollingInt8_t *self, rollingStep_t *step, const layerInt8_t *layer, const layerInt8_t *next,
                           spacing_t *spacing) {
  const bool joined = isConv(layer) && next != NULL && convCanPool(next) && spacing->rolling == spacing->window &&
                      spacing->rolling * next->kernelRows <= self->stride;
  step->dilation = spacing->window / spacing->rolling;
  step->taps = layer->kernelRows;
  step->rowBytes = layer->inColumns * layer->inChannels;
  self->receptiveSamples += (layer->kernelRows - 1) * spacing->window;
  if (layer->kind == LAYER_MAX_POOL) {
    step->period = spacing->rolling * layer->kernelRows <= self->stride ? layer->kernelRows : 1;
    passPool(self, layer, spacing);
  } else if (joined) {
    joinPool(step, layer, next);
    self->receptiveSamples += (next->kernelRows - 1) * spacing->window;
    passPool(self, next, spacing);
  }
  spacing->rolling *= step->period;
  return joined ? 2 : 1;
}

/** Plans the first dense layer, which reads the rows of the layer before it. */
static void planFirstDense(rollingInt8_t *self, rollingStep_t *step, const layerInt8_t *layer,
                           const spacing_t *spacing) {
  step->dilation = spacing->window / spacing->rolling;
  step->taps = layer->inRows;
  step->rowBytes = layer->inColumns * layer->inChannels;
  self->receptiveSamples += (layer->inRows - 1) * spacing->window;
}

bool rollingInt8Plan(rollingInt8_t *self, const networkInt8_t *network, int32_t stride) {
  spacing_t spacing = {1, 1};
  bool dense = false;
  if (networkInt8Check(network) >= 0 || network->layerCount < 1 || stride < 1 || stride > ROLLING_MAX_STRIDE) {
    return false;
  }
  memset(self, 0, sizeof(*self));
  self->stride = stride;
  self->receptiveSamples = 1;
  for (int32_t i = 0; i < network->layerCount;) {
    const layerInt8_t *layer = &network->layers[i];
    if (self->stepCount == ROLLING_MAX_STEPS || (dense && slides(layer))) {
      return false;
    }
    rollingStep_t *step = &self->steps[self->stepCount++];
    beginStep(step, layer);
    if (slides(layer)) {
      i += planSliding(self, step, layer, i + 1 < network->layerCount ? layer + 1 : NULL, &spacing);
      continue;
    }
    if (dense) {
      step->rowBytes = layer->inRows * layer->inColumns * layer->inChannels;
    } else {
      planFirstDense(self, step, layer, &spacing);
    }
    dense = true;
    i++;
  }
  return dense && spacing.rolling == stride;
}

static int32_t ringBytes(const rollingStep_t *step) {
  return alignedBytes(2 * step->taps * step->rowBytes) * step->dilation;
}

int32_t rollingInt8PlanBytes(const rollingInt8_t *planned) {
  int32_t bytes = alignedBytes(planned->steps[planned->stepCount - 1].layer.outChannels);
  for (int32_t i = 0; i < planned->stepCount; i++) {
    bytes += ringBytes(&planned->steps[i]);
  }
  return bytes;
}

int32_t rollingInt8ArenaBytes(const networkInt8_t *network, int32_t stride) {
  rollingInt8_t planned;
  return rollingInt8Plan(&planned, network, stride) ? rollingInt8PlanBytes(&planned) : 0;
}

bool rollingInt8Init(rollingInt8_t *self, const networkInt8_t *network, int32_t stride, int8_t *arena) {
  if (!rollingInt8Plan(self, network, stride)) {
    return false;
  }
  for (int32_t i = 0; i < self->stepCount; i++) {
    self->steps[i].ring = arena;
    arena += ringBytes(&self->steps[i]);
  }
  self->output = arena;
  rollingInt8Reset(self);
  return true;
}

void rollingInt8Reset(rollingInt8_t *self) {
  self->seen = 0;
  for (int32_t i = 0; i < self->stepCount; i++) {
    rollingStep_t *step = &self->steps[i];
    memset(step->ring, 0, (size_t)ringBytes(step));
    step->phase = 0;
    step->place = 0;
    step->wait = step->period;
  }
}

/**
 * Where the next input row goes; it is copied `taps` rows further on when it is complete, so that
 * the newest taps rows of its phase always lie one after the other.
 */
static int8_t *nextRow(const rollingStep_t *step) {
  return step->ring + step->phase * alignedBytes(2 * step->taps * step->rowBytes) + step->place * step->rowBytes;
}

/** The row at nextRow is complete. Returns the oldest of the newest taps rows of its phase. */
static const int8_t *push(rollingStep_t *step) {
  int8_t *row = nextRow(step);
  memcpy(row + step->taps * step->rowBytes, row, (size_t)step->rowBytes);
  const int8_t *oldest = row + step->rowBytes;
  if (++step->phase == step->dilation) {
    step->phase = 0;
    step->place = step->place + 1 < step->taps ? step->place + 1 : 0;
  }
  return oldest;
}

const int8_t *rollingInt8Step(rollingInt8_t *self, const int8_t *sample) {
  memcpy(nextRow(&self->steps[0]), sample, (size_t)self->steps[0].rowBytes);
  self->seen += self->seen < self->receptiveSamples ? 1 : 0;
  for (int32_t i = 0; i < self->stepCount; i++) {
    rollingStep_t *step = &self->steps[i];
    const int8_t *rows = push(step);
    if (--step->wait > 0) {
      return NULL;
    }
    step->wait = step->period;
    int8_t *to = i + 1 < self->stepCount ? nextRow(&self->steps[i + 1]) : self->output;
    layerInt8Run(&(jobInt8_t){.layer = &step->layer,
                              .pool = step->pool.kind == LAYER_MAX_POOL ? &step->pool : NULL,
                              .input = rows,
                              .output = to,
                              .core = 0,
                              .cores = 1});
  }
  return self->seen >= self->receptiveSamples ? self->output : NULL;
}
