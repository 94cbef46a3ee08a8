#pragma once

#include <stdbool.h>

bool supervisorIsFlying(void);
