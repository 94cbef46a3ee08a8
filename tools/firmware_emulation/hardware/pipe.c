// Frames between the board and the desktop: two pipes, by semihosting. A frame is kind (1 byte), length (2), bytes.
#include <string.h>

#include "board.h"
#include "stm32fxxx.h"

enum { OPEN = 1, WRITE = 5, READ = 6, EXIT_EXTENDED = 0x20 };  // semihosting

static int input, output;  // of the desktop

static int semihost(int operation, const void *arguments) {
  register int r0 __asm("r0") = operation;
  register const void *r1 __asm("r1") = arguments;
  __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void boardStop(int code) {
  const uint32_t arguments[2] = {0x20026, (uint32_t)code};
  semihost(EXIT_EXTENDED, arguments);
  while (1) {
  }
}

void boardRead(void *bytes, uint32_t length) {
  uint32_t left = length;
  while (left > 0) {
    const uint32_t arguments[3] = {(uint32_t)input, (uint32_t)bytes + length - left, left};
    const uint32_t now = (uint32_t)semihost(READ, arguments);
    if (now >= left) {
      boardStop(2);  // the desktop has gone
    }
    left = now;
  }
}

void boardSay(uint8_t kind, const void *bytes, uint16_t length) {
  static uint8_t out[3 + BOARD_BYTES];
  const uint32_t state = __get_PRIMASK();
  __disable_irq();
  out[0] = kind;
  memcpy(&out[1], &length, 2);
  memcpy(&out[3], bytes, length);
  const uint32_t arguments[3] = {(uint32_t)output, (uint32_t)out, 3u + length};
  semihost(WRITE, arguments);
  __set_PRIMASK(state);
}

static int openPipe(const char *name, int how) {
  const uint32_t arguments[3] = {(uint32_t)name, (uint32_t)how, strlen(name)};
  const int file = semihost(OPEN, arguments);
  if (file < 0) {
    boardStop(3);
  }
  return file;
}

void boardConnect(void) {
  input = openPipe("to_board", 1);
  output = openPipe("from_board", 5);
}
