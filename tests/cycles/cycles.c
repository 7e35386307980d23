/* Executed instructions (exact) and modelled cycles of a Cortex-M4F on an STM32F4, as a plugin of qemu-system-arm.

   Counted: what runs between two SEV instructions. Every pair is an entry of its own in the output, one JSON object a line; the last
   line holds the flash addresses that were executed or read in all entries.

   The model, from the Cortex-M4 Technical Reference Manual (3.3.1, 7.2.3) and ST's RM0090 (3.5.2, ART accelerator), at 168 MHz:
   - one cycle an instruction; a taken branch refills the pipeline (1 to 3 more), multiple loads take one more each, divisions 7;
   - neighbouring single loads and stores pipeline to one cycle; an address that the instruction before computed costs one more;
   - float: VMUL, VADD, VCVT one cycle, one more if the next instruction needs the result; VMLA 3, VDIV and VSQRT 14; VLDR as LDR;
   - an unaligned access costs one or two more;
   - flash: 5 wait states a line of 16 bytes; 64 instruction lines and 8 data lines, least recently used, kept between entries;
     the next instruction line is fetched ahead while the present one is executed.
   Not known to it: the early end of divisions, contention of the busses (weights in SRAM and stack share one), the exact fetch queue,
   refresh of the write buffer, interrupts. Take cycles as +-10 to 15 %.

   Arguments: out=FILE, stack=LOWEST_ADDRESS_OF_THE_STACK. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "instruction.h"
#include "plugin.h"

EXPORT int qemu_plugin_version = PLUGIN_API;

enum { WAIT_STATES = 5, LINE_SHIFT = 4, CODE_LINES = 64, DATA_LINES = 8, FLASH_SIZE = 1 << 20, MAX_ENTRIES = 1 << 14 };

struct entry {
    uint64_t instructions, cycles, code_waits, data_waits, lowest_store;
    uint64_t kinds[KINDS];
};

static struct entry entries[MAX_ENTRIES];
static unsigned finished;
static bool counting;
static const struct instruction *previous;
static uint64_t stack_start;
static const char *output;
static uint8_t executed[FLASH_SIZE], loaded[FLASH_SIZE];

/* --- flash accelerator --- */

struct lines {
    unsigned count;
    uint32_t line[CODE_LINES];
    uint64_t used[CODE_LINES];
};

static struct lines code_lines = { .count = CODE_LINES }, data_lines = { .count = DATA_LINES };
static uint64_t clock_of_use = 1;
static uint32_t last_line;
static uint64_t last_line_at;
static const uint32_t NO_LINE = ~0u;

/* Flash is also visible from address 0. */
static bool in_flash(uint32_t address) { return (address >= 0x08000000 && address < 0x08100000) || address < 0x00100000; }

/* Whether the line was there; it is afterwards. Stored plus one, so that zero is an empty place. */
static bool hit(struct lines *lines, uint32_t line) {
    unsigned oldest = 0;
    for (unsigned k = 0; k < lines->count; k++) {
        if (lines->line[k] == line + 1) {
            lines->used[k] = clock_of_use++;
            return true;
        }
        if (lines->used[k] < lines->used[oldest]) oldest = k;
    }
    lines->line[oldest] = line + 1;
    lines->used[oldest] = clock_of_use++;
    return false;
}

static uint64_t now(const struct entry *e) { return e->cycles + e->code_waits + e->data_waits; }

static void fetch(struct entry *e, const struct instruction *i) {
    uint32_t at = i->address & (FLASH_SIZE - 1);
    for (uint32_t line = at >> LINE_SHIFT; line <= (at + i->size - 1) >> LINE_SHIFT; line++) {
        if (line == last_line) continue;
        if (!hit(&code_lines, line)) {
            /* The next line has been on its way since the present one was entered. */
            uint64_t ahead = last_line != NO_LINE && line == last_line + 1 ? now(e) - last_line_at : 0;
            e->code_waits += ahead >= WAIT_STATES ? 0 : WAIT_STATES - ahead;
        }
        last_line = line;
        last_line_at = now(e);
    }
}

/* --- pipeline --- */

static unsigned branch_refill(const struct instruction *branch, const struct instruction *target) {
    if (branch->kind == BRANCH_REGISTER || branch->kind == TABLE_BRANCH || branch->loads_pc) return 3;
    return target->size == 4 && target->address & 3 ? 2 : 1;
}

static bool single_float(const struct instruction *i) { return i->kind == VLDR && !i->double_precision; }

static unsigned price(const struct instruction *i) {
    bool after_load = previous && previous->kind == LDR && !(previous->writes & i->address_of);
    bool after_any_load = after_load || (previous && single_float(previous));
    switch (i->kind) {
    case LDR: return i->loads_pc || !after_any_load ? 2 : 1;
    case STR: return i->register_offset && !after_load ? 2 : 1;
    case LDRD: case STRD: case TABLE_BRANCH: case VMAC: return 3;
    case LDM: case STM: case VLDM: case VSTM: return 1u + i->registers;
    case DIV: return 7;
    case VDIV: return 14;
    case VMOV2: return 2;
    case VLDR: case VSTR: return i->double_precision ? 3 : after_any_load ? 1 : 2;
    default: return 1;
    }
}

static unsigned stalls(const struct instruction *i) {
    if (!previous) return 0;
    unsigned cycles = 0;
    if (i->address != previous->address + previous->size) cycles += branch_refill(previous, i);
    if (previous->writes_float & i->reads_float) cycles++;
    bool access = (i->kind >= LDR && i->kind <= STM) || (i->kind >= VLDR && i->kind <= VSTM);
    bool forwarded = previous->kind >= LDR && previous->kind <= STR;
    if (access && !forwarded && previous->writes & i->address_of) cycles++;
    return cycles;
}

/* --- what QEMU calls --- */

static void on_instruction(unsigned cpu, void *data) {
    const struct instruction *i = data;
    (void)cpu;
    if (i->kind == MARKER) {
        if (counting) finished++;
        counting = !counting && finished < MAX_ENTRIES;
        if (counting) entries[finished].lowest_store = ~0ull;
        previous = NULL;
        last_line = NO_LINE;
        return;
    }
    if (!counting) return;
    struct entry *e = &entries[finished];
    e->instructions++;
    e->kinds[i->kind]++;
    e->cycles += price(i) + stalls(i);
    if (in_flash(i->address)) {
        memset(&executed[i->address & (FLASH_SIZE - 1)], 1, i->size);
        fetch(e, i);
    }
    previous = i;
}

static void on_access(unsigned cpu, memory_info info, uint64_t address, void *data) {
    (void)cpu, (void)data;
    if (!counting) return;
    struct entry *e = &entries[finished];
    unsigned size = 1u << qemu_plugin_mem_size_shift(info);
    if ((size == 2 && address & 1) || (size >= 4 && address & 3)) e->cycles += size >= 4 && address & 1 ? 2 : 1;
    if (qemu_plugin_mem_is_store(info)) {
        if (address >= stack_start && address < e->lowest_store) e->lowest_store = address;
    } else if (in_flash((uint32_t)address)) {
        uint32_t at = address & (FLASH_SIZE - 1);
        memset(&loaded[at], 1, size);
        if (!hit(&data_lines, at >> LINE_SHIFT)) e->data_waits += WAIT_STATES;
    }
}

static void on_translation(plugin_id id, struct qemu_plugin_tb *block) {
    (void)id;
    for (size_t k = 0; k < qemu_plugin_tb_n_insns(block); k++) {
        struct qemu_plugin_insn *source = qemu_plugin_tb_get_insn(block, k);
        struct instruction *i = calloc(1, sizeof *i); /* lives as long as the translation may */
        if (!i) abort();
        i->address = (uint32_t)qemu_plugin_insn_vaddr(source);
#if PLUGIN_API >= 3
        uint8_t bytes[4] = { 0 };
        qemu_plugin_insn_data(source, bytes, sizeof bytes);
#else
        const uint8_t *bytes = qemu_plugin_insn_data(source);
#endif
        /* Not from QEMU 7, which is wrong about it at the ends of its pages of 1 KiB. */
        i->size = bytes[1] >> 3 >= 0x1d ? 4 : 2;
        decode(i, bytes);
        qemu_plugin_register_vcpu_insn_exec_cb(source, on_instruction, NO_REGISTERS, i);
        qemu_plugin_register_vcpu_mem_cb(source, on_access, NO_REGISTERS, READS_AND_WRITES, i);
    }
}

static void print_ranges(FILE *file, const char *name, const uint8_t *map) {
    const char *comma = "";
    fprintf(file, "\"%s\":[", name);
    for (size_t start = 0; start < FLASH_SIZE; start++) {
        if (!map[start]) continue;
        size_t end = start;
        while (end < FLASH_SIZE && map[end]) end++;
        fprintf(file, "%s[%zu,%zu]", comma, start, end - start);
        comma = ",";
        start = end;
    }
    fprintf(file, "]");
}

static void on_exit_of_emulator(plugin_id id, void *data) {
    (void)id, (void)data;
    FILE *file = output ? fopen(output, "w") : stderr;
    if (!file) abort();
    for (unsigned k = 0; k < finished; k++) {
        const struct entry *e = &entries[k];
        fprintf(file, "{\"instructions\":%llu,\"cycles\":%llu,\"code_waits\":%llu,\"data_waits\":%llu,\"lowest_store\":%llu,\"kinds\":{",
                (unsigned long long)e->instructions, (unsigned long long)e->cycles, (unsigned long long)e->code_waits,
                (unsigned long long)e->data_waits, (unsigned long long)e->lowest_store);
        const char *comma = "";
        for (int kind = 0; kind < KINDS; kind++) {
            if (!e->kinds[kind]) continue;
            fprintf(file, "%s\"%s\":%llu", comma, kind_names[kind], (unsigned long long)e->kinds[kind]);
            comma = ",";
        }
        fprintf(file, "}}\n");
    }
    fprintf(file, "{");
    print_ranges(file, "executed", executed);
    fprintf(file, ",");
    print_ranges(file, "loaded", loaded);
    fprintf(file, "}\n");
    if (output) fclose(file);
}

EXPORT int qemu_plugin_install(plugin_id id, const void *info, int count, char **arguments) {
    (void)info;
    for (int k = 0; k < count; k++) {
        if (!strncmp(arguments[k], "out=", 4)) output = strdup(arguments[k] + 4);
        if (!strncmp(arguments[k], "stack=", 6)) stack_start = strtoull(arguments[k] + 6, NULL, 0);
    }
    qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
    qemu_plugin_register_atexit_cb(id, on_exit_of_emulator, NULL);
    return 0;
}
