#include <stdint.h>
int32_t airtouchAbi(void) { return 1; }
