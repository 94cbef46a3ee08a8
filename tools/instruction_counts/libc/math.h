// What the kernels need of <math.h>, for a cross compiler that comes without a C library.
#pragma once

#define NAN __builtin_nanf("")
#define INFINITY __builtin_inff()
#define isfinite(x) __builtin_isfinite(x)
#define isnan(x) __builtin_isnan(x)
#define isinf(x) __builtin_isinf(x)
#define signbit(x) __builtin_signbit(x)

float sqrtf(float x);
float fabsf(float x);
float fminf(float x, float y);
float fmaxf(float x, float y);
float copysignf(float x, float y);
float floorf(float x);
float ceilf(float x);
float roundf(float x);
float truncf(float x);
float fmodf(float x, float y);
float sinf(float x);
float cosf(float x);
float expf(float x);
float expm1f(float x);
float logf(float x);
float frexpf(float x, int *exponent);
float ldexpf(float x, int exponent);
double exp(double x);
