#include "rolling_int8.h"

#include <stddef.h>
#include <string.h>

#include "conv_int8.h"

static int32_t aligned(int32_t bytes) { return (bytes + 3) & ~3; }

static int32_t isConv(const layerInt8_t *layer) {
  return layer->kind == LAYER_CONV || layer->kind == LAYER_SPARSE_CONV;
}

// A step of one layer, for one row of output: as many rows of input as it reads for that.
static void beginStep(rollingStep_t *step, const layerInt8_t *layer) {
  step->layer = *layer;
  if (isConv(layer) || layer->kind == LAYER_MAX_POOL) {
    step->layer.inRows = layer->kernelRows;
    step->layer.outRows = 1;
  }
  step->taps = 1;
  step->dilation = 1;
  step->period = 1;
}

// Rows of a layer's input are `period` samples apart; in the window neighbouring rows are
// `apart` samples apart. A pool multiplies `apart`; `period` follows until it reaches the stride.
int32_t rollingInt8Plan(rollingInt8_t *self, const networkInt8_t *network, int32_t stride) {
  int32_t apart = 1, period = 1, dense = 0;
  if (networkInt8Check(network) >= 0 || network->layerCount < 1 || stride < 1 || stride > ROLLING_MAX_STRIDE) {
    return 0;
  }
  memset(self, 0, sizeof(*self));
  self->stride = stride;
  self->receptive = 1;
  for (int32_t i = 0; i < network->layerCount; i++) {
    const layerInt8_t *layer = &network->layers[i];
    const layerInt8_t *pool = i + 1 < network->layerCount ? &network->layers[i + 1] : NULL;
    if (self->stepCount == ROLLING_MAX_STEPS || (dense && (isConv(layer) || layer->kind == LAYER_MAX_POOL))) {
      return 0;
    }
    rollingStep_t *step = &self->steps[self->stepCount++];
    beginStep(step, layer);
    if (isConv(layer) || layer->kind == LAYER_MAX_POOL) {
      step->dilation = apart / period;
      step->taps = layer->kernelRows;
      step->rowBytes = layer->inColumns * layer->inChannels;
      self->receptive += (layer->kernelRows - 1) * apart;
      if (layer->kind == LAYER_MAX_POOL) {
        step->period = period * layer->kernelRows <= stride ? layer->kernelRows : 1;
      } else if (pool && convCanPool(pool) && period == apart && period * pool->kernelRows <= stride) {
        // Rows of the convolution that only the pool reads: both at once, never stored.
        step->pool = *pool;
        step->pool.inRows = pool->kernelRows;
        step->pool.outRows = 1;
        step->layer.outRows = pool->kernelRows;
        step->layer.inRows = layer->kernelRows + pool->kernelRows - 1;
        step->taps = step->layer.inRows;
        step->period = pool->kernelRows;
        self->receptive += (pool->kernelRows - 1) * apart;
        layer = pool;
        i++;
      }
      if (layer->kind == LAYER_MAX_POOL) {
        // Rows that the window's pool drops are its newest.
        self->ahead += layer->inRows % layer->kernelRows * apart;
        apart *= layer->kernelRows;
      }
      period *= step->period;
    } else if (!dense) {
      dense = 1;
      step->dilation = apart / period;
      step->taps = layer->inRows;
      step->rowBytes = layer->inColumns * layer->inChannels;
      self->receptive += (layer->inRows - 1) * apart;
    } else {
      step->rowBytes = layer->inRows * layer->inColumns * layer->inChannels;
    }
  }
  return dense && period == stride;
}

static int32_t ringBytes(const rollingStep_t *step) {
  return aligned(2 * step->taps * step->rowBytes) * step->dilation;
}

int32_t rollingInt8PlanBytes(const rollingInt8_t *planned) {
  int32_t bytes = aligned(planned->steps[planned->stepCount - 1].layer.outChannels);
  for (int32_t i = 0; i < planned->stepCount; i++) {
    bytes += ringBytes(&planned->steps[i]);
  }
  return bytes;
}

int32_t rollingInt8ArenaBytes(const networkInt8_t *network, int32_t stride) {
  rollingInt8_t planned;
  return rollingInt8Plan(&planned, network, stride) ? rollingInt8PlanBytes(&planned) : 0;
}

int32_t rollingInt8Init(rollingInt8_t *self, const networkInt8_t *network, int32_t stride, int8_t *arena) {
  if (!rollingInt8Plan(self, network, stride)) {
    return 0;
  }
  for (int32_t i = 0; i < self->stepCount; i++) {
    self->steps[i].ring = arena;
    arena += ringBytes(&self->steps[i]);
  }
  self->output = arena;
  rollingInt8Reset(self);
  return 1;
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

// Where the next input row goes; it is copied `taps` rows further on when it is complete, so that
// the newest taps rows of its phase always lie one after the other.
static int8_t *nextRow(const rollingStep_t *step) {
  return step->ring + step->phase * aligned(2 * step->taps * step->rowBytes) + step->place * step->rowBytes;
}

// The row at nextRow is complete. Returns the oldest of the newest taps rows of its phase.
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
  self->seen += self->seen < self->receptive ? 1 : 0;
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
  return self->seen >= self->receptive ? self->output : NULL;
}
