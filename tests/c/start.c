/* Start of a C program on the emulated board: vector table, FPU on, then newlib's start-up. */
#include <stdint.h>

extern uint32_t __stack;
extern void _start(void);

void Reset(void)
{
    /* Full access to the FPU (CPACR). */
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
    __asm volatile("dsb\n\tisb");
    _start();
}

/* A jump to 0, which is no Thumb address: the core locks up and QEMU ends. */
__attribute__((section(".vectors"), used)) static const void *const vectors[] = {&__stack, (const void *)Reset, 0, 0};
