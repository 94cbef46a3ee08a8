// Shapes whose sizes leave int32: the checks must refuse them. 65536 x 65536 wraps to no value at all.
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

int main(void) {
  const layerInt8_t wraps[] = {DENSE(65536, 65536, 1, 1), DENSE(1 << 20, 4096, 1, 1), DENSE(46341, 46341, 1, 1),
                               DENSE(1, 1, INT32_MAX, 1), DENSE(2, 1, 1, INT32_MAX)};
  for (unsigned i = 0; i < sizeof wraps / sizeof wraps[0]; i++) {
    printf("%d ", networkInt8Check(&(networkInt8_t){.layers = &wraps[i], .layerCount = 1}));
  }
  const layerInt8_t pool = {.kind = LAYER_CONV,
                            .inRows = 1 << 16,
                            .inColumns = 1 << 16,
                            .inChannels = 1,
                            .outRows = 1,
                            .outColumns = 1,
                            .outChannels = 1,
                            .kernelRows = 1 << 16,
                            .kernelColumns = 1 << 16};
  printf("%d ", networkInt8Check(&(networkInt8_t){.layers = &pool, .layerCount = 1}));
  const layerInt8_t head = DENSE(1, 1, 1, 1), far = DENSE(65536, 1, 65536, 1);
  const streamConv_t convs[] = {{.layer = DENSE(4, 1, 1, 1), .dilation = 1},
                                {.layer = DENSE(4, 1, 1, 1), .dilation = 1 << 30},
                                {.layer = far, .dilation = 1}};
  const streamInt8_t spread = {.convs = convs, .convCount = 2, .stride = 1, .firstSkip = 1, .head = &head};
  const streamInt8_t wide = {.convs = convs + 2, .convCount = 1, .stride = 1, .head = &head};
  const streamInt8_t tall = {.convs = convs, .convCount = 1, .stride = 1, .head = &far};
  printf("%d %d %d\n", streamInt8Check(&spread), streamInt8Check(&wide), streamInt8Check(&tall));
  // 4 + stride * 3 * 4000 samples and stride - 1 more: 48,007 at 4; 65,535 is the most.
  const streamConv_t back[] = {{.layer = DENSE(4, 1, 1, 1), .dilation = 1},
                               {.layer = DENSE(4, 1, 1, 1), .dilation = 4000}};
  for (int32_t stride = 4; stride <= 6; stride++) {
    const streamInt8_t past = {.convs = back, .convCount = 2, .stride = stride, .firstSkip = 1, .head = &head};
    printf("%d ", streamInt8Check(&past));
  }
  const streamInt8_t slow = {.convs = back, .convCount = 2, .stride = INT32_MAX, .firstSkip = 1, .head = &head};
  printf("%d\n", streamInt8Check(&slow));
  return 0;
}
