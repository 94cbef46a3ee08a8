#pragma once

void debugPrint(const char *format, ...) __attribute__((format(printf, 1, 2)));
#define DEBUG_PRINT(...) debugPrint(__VA_ARGS__)
