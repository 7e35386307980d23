/* Start of a C program on the emulated board: vector table, FPU on, then newlib's start-up. */
#include <stdint.h>

/* The linker's address of the stack's end, declared as what a vector table is made of. */
extern void __stack(void);
extern void _start(void);
void Reset(void);

void Reset(void)
{
    /* Full access to the FPU (CPACR). */
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
    __asm__ volatile("dsb\n\tisb");
    _start();
}

/* A fault jumps to 0, which is no Thumb address: the core locks up and QEMU ends. */
__attribute__((section(".vectors"), used)) static void (*const vectors[])(void) = {__stack, Reset, 0, 0};
