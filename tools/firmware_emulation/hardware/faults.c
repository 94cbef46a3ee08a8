// Console, failed assertions and faults.
#include <stdint.h>
#include <string.h>

#include "board.h"

#define LINE 120

int __real_consolePutchar(int ch);
int __wrap_consolePutchar(int ch) {
  static char line[LINE];
  static uint16_t length;
  line[length++] = (char)ch;
  if (ch == '\n' || length == LINE) {
    boardSay('C', line, length);
    length = 0;
  }
  return __real_consolePutchar(ch);
}

void __wrap_assertFail(char *what, char *file, int line) {
  static char text[LINE + 16];
  uint16_t length = 0;
  for (const char *c = what; *c && length < 60; c++) {
    text[length++] = *c;
  }
  text[length++] = ' ';
  const char *name = strrchr(file, '/') ? strrchr(file, '/') + 1 : file;
  for (const char *c = name; *c && length < LINE; c++) {
    text[length++] = *c;
  }
  text[length++] = ':';
  char digits[8];
  int count = 0;
  for (int n = line; n > 0; n /= 10) {
    digits[count++] = (char)('0' + n % 10);
  }
  while (count > 0) {
    text[length++] = digits[--count];
  }
  boardSay('!', text, length);
  boardStop(7);
}

/** Both are called where the firmware would halt: BusFault and its like, and HardFault. */
void __wrap_storeAssertTextData(const char *text) {
  boardSay('!', text, (uint16_t)strlen(text));
  boardStop(7);
}

void __wrap_storeAssertHardfaultData(unsigned r0, unsigned r1, unsigned r2, unsigned r3, unsigned r12, unsigned lr,
                                     unsigned pc, unsigned psr) {
  const uint32_t registers[8] = {r0, r1, r2, r3, r12, lr, pc, psr};
  boardSay('X', registers, sizeof registers);
  boardStop(8);
}
