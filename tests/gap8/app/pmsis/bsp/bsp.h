#pragma once
void pi_bsp_init(void);
