// Edges out of samples, in C++: the program of host/docs/port.md, which its test builds and runs.
// In: rows of ten floats (acceleration m/s^2, level, with gravity; rates rad/s; PWM). Out: logits and edges.
#include <cstdio>
#include <cstring>

#include "airtouch_stream.h"
#include "stream_detector.h"

int main() {
  alignas(4) static int8_t arena[AIRTOUCH_STREAM_ARENA_BYTES];
  streamDetector_t detector;
  if (streamInt8Check(&airtouchStream) >= 0 || streamInt8ArenaBytes(&airtouchStream) > AIRTOUCH_STREAM_ARENA_BYTES ||
      !streamDetectorInit(&detector, &airtouchStreamMotion, &airtouchStream, &airtouchStreamQuantisation,
                          &airtouchStreamDecoder, arena)) {
    std::fputs("this network does not fit the detector\n", stderr);
    return 1;
  }
  float row[10];
  for (int i = 0; std::fread(row, sizeof row, 1, stdin) == 1; i++) {
    streamEvent_t event;
    streamDetectorStep(&detector, row, row + 3, row + 6, &event);
    uint32_t bits[3];
    std::memcpy(bits, event.logits, sizeof bits);
    std::printf("%d %08x %08x %08x %d\n", i, bits[0], bits[1], bits[2], event.edge);
  }
  return 0;
}
