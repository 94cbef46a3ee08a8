// Shapes whose sizes leave int32: the checks must refuse them. 65536 x 65536 wraps to no value at all.
#include <stdbool.h>
#include <stdio.h>

#include "network_int8.h"
#include "stream_int8.h"

#define DENSE(rows, columns, channels, outputs) \
  {.kind = LAYER_DENSE,                         \
   .inRows = rows,                              \
   .inColumns = columns,                        \
   .inChannels = channels,                      \
   .outRows = 1,                                \
   .outColumns = 1,                             \
   .outChannels = outputs,                      \
   .kernelRows = 1,                             \
   .kernelColumns = 1}

static void layer(const char *name, layerInt8_t shape) {
  const bool good = networkInt8Check(&(networkInt8_t){.layers = &shape, .layerCount = 1}) < 0;
  printf("%s: %s\n", name, good ? "good" : "refused");
}

static void stream(const char *name, streamInt8_t network) {
  const int32_t at = streamInt8Check(&network);
  const bool head = at == network.convCount;
  printf("%s: %s", name, at < 0 ? "good\n" : (head ? "head refused\n" : "convolution "));
  if (at >= 0 && !head) {
    printf("%d refused\n", at);
  }
}

int main(void) {
  layer("dense, rows x columns wrap to 0", (layerInt8_t)DENSE(65536, 65536, 1, 1));
  layer("dense, 2^20 x 4096", (layerInt8_t)DENSE(1 << 20, 4096, 1, 1));
  layer("dense, 46341 squared", (layerInt8_t)DENSE(46341, 46341, 1, 1));
  layer("dense, most channels", (layerInt8_t)DENSE(1, 1, INT32_MAX, 1));
  layer("dense, most outputs", (layerInt8_t)DENSE(2, 1, 1, INT32_MAX));
  layer("convolution, rows x columns wrap to 0", (layerInt8_t){.kind = LAYER_CONV,
                                                               .inRows = 1 << 16,
                                                               .inColumns = 1 << 16,
                                                               .inChannels = 1,
                                                               .outRows = 1,
                                                               .outColumns = 1,
                                                               .outChannels = 1,
                                                               .kernelRows = 1 << 16,
                                                               .kernelColumns = 1 << 16});
  const layerInt8_t head = DENSE(1, 1, 1, 1), far = DENSE(65536, 1, 65536, 1);
  const streamConv_t convs[] = {{.layer = DENSE(4, 1, 1, 1), .dilation = 1},
                                {.layer = DENSE(4, 1, 1, 1), .dilation = 1 << 30},
                                {.layer = far, .dilation = 1}};
  stream("stream, dilation of 2^30",
         (streamInt8_t){.convs = convs, .convCount = 2, .stride = 1, .firstSkip = 1, .head = &head});
  stream("stream, rows x channels wrap to 0",
         (streamInt8_t){.convs = convs + 2, .convCount = 1, .stride = 1, .head = &head});
  stream("stream, the head's rows x channels wrap to 0",
         (streamInt8_t){.convs = convs, .convCount = 1, .stride = 1, .head = &far});
  // 4 + stride * 3 * 4000 samples and stride - 1 more: 48,007 at 4; 65,535 is the most.
  const streamConv_t back[] = {{.layer = DENSE(4, 1, 1, 1), .dilation = 1},
                               {.layer = DENSE(4, 1, 1, 1), .dilation = 4000}};
  const int32_t strides[] = {4, 5, 6, INT32_MAX};
  for (int i = 0; i < 4; i++) {
    char name[32];
    snprintf(name, sizeof name, "window, stride %d", strides[i]);
    stream(name, (streamInt8_t){.convs = back, .convCount = 2, .stride = strides[i], .firstSkip = 1, .head = &head});
  }
  return 0;
}
